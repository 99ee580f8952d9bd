"""OpenMM on Hénon–Heiles: one particle in an external force, double precision, units of 1."""

from __future__ import annotations

from typing import Any

import numpy as np
import openmm


def run(method: str, q: Any, p: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """`steps` steps of the length h."""
    bodies = openmm.System()
    bodies.addParticle(1.0)
    for group, energy in enumerate(("(x^2+y^2)/2+z^2", "x^2*y-y^3/3")):
        force = openmm.CustomExternalForce(energy)
        force.addParticle(0, [])
        force.setForceGroup(group)
        bodies.addForce(force)
    platform = openmm.Platform.getPlatformByName("Reference")
    if method == "Verlet":
        integrator: Any = openmm.VerletIntegrator(h)
    else:  # the first force twice a step
        integrator = openmm.mtsintegrator.MTSIntegrator(h, [(0, 2), (1, 1)])
    context = openmm.Context(bodies, integrator, platform)
    context.setPositions([[*q, 0.0]])
    context.setVelocities([[*p, 0.0]])
    rows = [(q, p)]
    for _ in range(steps // every):
        integrator.step(every)
        state = context.getState(getPositions=True, getVelocities=True)
        at, v = state.getPositions(asNumpy=True), state.getVelocities(asNumpy=True)
        rows.append((np.array(at._value[0, :2]), np.array(v._value[0, :2])))
    return np.array([x for x, _ in rows]), np.array([v for _, v in rows])
