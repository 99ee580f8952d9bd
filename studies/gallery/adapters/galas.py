"""gala.integrate: its Python integrators, given the scene's derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np
from gala import integrate


def run(method: str, q: Any, p: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """`steps` steps of the length h."""

    def f(t: float, w: np.ndarray) -> np.ndarray:  # (2n, orbits), positions first
        return np.concatenate(system.f(w[: len(q), 0], w[len(q) :, 0]))[:, None]

    with np.errstate(all="ignore"):
        orbit = getattr(integrate, method)(f, progress=False)(
            np.concatenate([q, p]), dt=h, n_steps=steps
        )
    return orbit.pos.xyz.value.T[::every], orbit.vel.d_xyz.value.T[::every]
