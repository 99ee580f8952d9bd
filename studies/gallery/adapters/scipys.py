"""scipy.integrate's Runge–Kutta methods, with a tolerance that every step keeps."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import integrate

LOOSE = 1e3  # a tolerance that every step keeps, so that each is max_step long


def run(method: str, q: Any, p: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """`steps` steps of the length h."""

    def f(t: float, z: np.ndarray) -> np.ndarray:
        return np.concatenate(system.f(z[: len(q)], z[len(q) :]))

    z = np.concatenate([q, p])
    solver = getattr(integrate, method)(
        f, 0.0, z, np.sign(h) * np.inf, abs(h), LOOSE, LOOSE, first_step=abs(h)
    )
    rows = [z]
    for k in range(1, steps + 1):
        solver.step()
        if k % every == 0:
            rows.append(solver.y)
    table = np.array(rows)
    return table[:, : len(q)], table[:, len(q) :]
