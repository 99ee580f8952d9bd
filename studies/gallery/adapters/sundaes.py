"""SUNDIALS' CVODE by scikit-sundae: steps of its own, h is only the time between rows."""

from __future__ import annotations

from typing import Any

import numpy as np
from sksundae.cvode import CVODE


def run(method: str, q: Any, p: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """To the times of the rows, by Adams' methods or by BDF."""
    n = len(q)

    def f(t: float, z: np.ndarray, rates: np.ndarray) -> None:
        rates[:n], rates[n:] = system.f(z[:n].copy(), z[n:].copy())

    solver = CVODE(f, method=method, rtol=1e-12, atol=1e-14, max_num_steps=10**6)
    times = np.arange(steps // every + 1) * every * h
    if len(times) == 1:
        return q[None], p[None]
    rows = solver.solve(times, np.concatenate([q, p])).y
    rows = rows[[0, -1]] if len(times) == 2 else rows  # of two times it gives its own steps
    rows[0] = np.concatenate([q, p])
    return rows[:, :n], rows[:, n:]
