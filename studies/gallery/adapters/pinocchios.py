"""pinocchio on the double pendulum: its dynamics, and the step that its examples make with them."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pinocchio


@cache
def model(g: float) -> Any:
    """(model, data) of two point masses of 1 on rods of 1."""
    made = pinocchio.Model()
    made.gravity.linear = np.array([0.0, 0.0, -g])
    for parent, z in ((0, 0.0), (1, -1.0)):
        place = pinocchio.SE3(np.eye(3), np.array([0.0, 0.0, z]))
        joint = made.addJoint(parent, pinocchio.JointModelRY(), place, f"joint{parent}")
        ball = pinocchio.Inertia(1.0, np.array([0.0, 0.0, -1.0]), np.zeros((3, 3)))
        made.appendBodyToJoint(joint, ball, pinocchio.SE3.Identity())
    return made, made.createData()


def step(q: Any, v: Any, h: float, system: Any) -> Any:
    """v ← v + h a(q, v), then q ← q ⊕ h v."""
    made, data = model(float(system.parameters.gravity))
    angles, speeds = np.diff(q, prepend=0.0), np.diff(v, prepend=0.0)
    speeds = speeds + h * pinocchio.aba(made, data, angles, speeds, np.zeros(2))
    angles = pinocchio.integrate(made, angles, h * speeds)
    return np.cumsum(angles), np.cumsum(speeds)
