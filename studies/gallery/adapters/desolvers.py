"""desolver's integrators, called step by step, so that all steps have the length h."""

from __future__ import annotations

from typing import Any

import desolver
import numpy as np


def run(method: str, q: Any, p: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """`steps` steps of the length h."""

    def f(t: float, z: np.ndarray) -> np.ndarray:
        return np.concatenate(system.f(z[: len(q)], z[len(q) :]))

    z, rows = np.concatenate([q, p]), [np.concatenate([q, p])]
    made = getattr(desolver.integrators, method)(z.shape, z.dtype, rtol=1e-14, atol=1e-14)
    right = desolver.DiffRHS(f)
    for k in range(1, steps + 1):
        length, change = made(right, np.float64((k - 1) * h), z, {}, np.float64(h))[1]
        if length != h:
            raise ValueError(f"a step of {length} where one of {h} was asked for")
        z = z + change
        if k % every == 0:
            rows.append(z)
    table = np.array(rows)
    return table[:, : len(q)], table[:, len(q) :]
