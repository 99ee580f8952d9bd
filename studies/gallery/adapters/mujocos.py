"""MuJoCo on the double pendulum: joint angles are relative, momenta come from velocities.

Two compound bodies have the inertia and the weight of the scene's two point masses (all of them 1):
MuJoCo has no body without inertia.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import mujoco
import numpy as np

BODIES = """<mujoco>
<option gravity="0 0 -{g!r}" integrator="{method}"><flag contact="disable"/></option>
<worldbody><body><joint axis="0 -1 0"/>
<inertial pos="0 0 -0.5" mass="1.5" diaginertia="0.375 0.375 0.375"/><body pos="0 0 -1">
<joint axis="0 -1 0"/><inertial pos="0 0 -0.8" mass="1.25" diaginertia="0.2 0.2 0.2"/>
</body></body></worldbody></mujoco>"""


@cache
def model(method: str, g: float) -> Any:
    """(model, data) of the two bodies."""
    made = mujoco.MjModel.from_xml_string(BODIES.format(g=g, method=method))
    return made, mujoco.MjData(made)


def run(method: str, q: Any, v: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """`steps` steps of the length h, in angles from the vertical and their velocities."""
    made, data = model(method, float(system.parameters.gravity))
    mujoco.mj_resetData(made, data)
    made.opt.timestep, rows = h, [(q, v)]
    data.qpos[:], data.qvel[:] = (q[0], q[1] - q[0]), (v[0], v[1] - v[0])
    for k in range(1, steps + 1):
        mujoco.mj_step(made, data)
        if k % every == 0:
            rows.append((np.cumsum(data.qpos), np.cumsum(data.qvel)))
    return tuple(np.array(part) for part in zip(*rows, strict=True))
