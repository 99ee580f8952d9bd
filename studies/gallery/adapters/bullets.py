"""PyBullet on the pendulum: one link on a hinge, without a motor, damping or a shape."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pybullet


@cache
def pendulum(g: float) -> tuple[int, int]:
    """(client, body) of a point mass of 1 on a rod of 1."""
    client = pybullet.connect(pybullet.DIRECT)
    body = pybullet.createMultiBody(
        0, linkMasses=[1], linkCollisionShapeIndices=[-1], linkVisualShapeIndices=[-1],
        linkPositions=[[0, 0, 0]], linkOrientations=[[0, 0, 0, 1]], linkParentIndices=[0],
        linkInertialFramePositions=[[0, 0, -1]], linkInertialFrameOrientations=[[0, 0, 0, 1]],
        linkJointTypes=[pybullet.JOINT_REVOLUTE], linkJointAxis=[[0, 1, 0]], physicsClientId=client,
    )  # fmt: skip
    pybullet.setGravity(0, 0, -g, client)
    pybullet.changeDynamics(body, 0, linearDamping=0, angularDamping=0, jointDamping=0,
                            localInertiaDiagonal=[0, 0, 0], physicsClientId=client)  # fmt: skip
    motor = pybullet.VELOCITY_CONTROL
    pybullet.setJointMotorControl2(body, 0, motor, force=0, physicsClientId=client)
    return client, body


def run(q: Any, v: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """`steps` steps of the length h."""
    client, body = pendulum(float(system.parameters.gravity))
    pybullet.setTimeStep(h, client)
    pybullet.resetJointState(body, 0, q[0], v[0], physicsClientId=client)
    rows = [(q[0], v[0])]
    for _ in range(steps):
        pybullet.stepSimulation(client)
        rows.append(pybullet.getJointState(body, 0, client)[:2])
    table = np.array(rows[::every])
    return table[:, :1], table[:, 1:]
