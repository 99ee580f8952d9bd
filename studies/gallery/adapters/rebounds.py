"""rebound: bodies that attract each other; momenta are masses times velocities."""

from __future__ import annotations

from typing import Any

import numpy as np
import rebound


def run(method: str, q: Any, p: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """`steps` steps of the length h; of IAS15, whose steps are its own, to the same times."""
    simulation = rebound.Simulation()
    simulation.G, simulation.integrator, simulation.dt = system.parameters.G, method, h
    masses = np.asarray(system.parameters.masses)[:, None]
    for m, at, v in zip(masses[:, 0], q.reshape(-1, 3), p.reshape(-1, 3) / masses, strict=True):
        simulation.add(m=m, x=at[0], y=at[1], z=at[2], vx=v[0], vy=v[1], vz=v[2])
    rows = np.zeros((steps // every + 1, 2, len(masses), 3))
    for k, (x, v) in enumerate(rows):
        if k and method == "ias15":
            simulation.integrate(k * every * h)
        elif k:
            simulation.steps(every)
            simulation.synchronize()
        simulation.serialize_particle_data(xyz=x, vxvyvz=v)
    rows[:, 1] *= masses
    rows[0] = q.reshape(-1, 3), p.reshape(-1, 3)
    return tuple(np.swapaxes(rows, 0, 1).reshape(2, len(rows), -1))
