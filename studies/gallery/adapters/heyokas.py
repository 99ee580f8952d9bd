"""heyoka's Taylor series: steps of its own, so that h is only the time between rows."""

from __future__ import annotations

from functools import cache
from typing import Any

import heyoka
import numpy as np


@cache
def integrator() -> Any:
    """Hénon–Heiles, compiled once."""
    x, y, u, v = heyoka.make_vars("x", "y", "u", "v")
    equations = [(x, u), (y, v), (u, -x - 2 * x * y), (v, -y - x**2 + y**2)]
    return heyoka.taylor_adaptive(equations, [0.0, 0.1, 0.49, 0.0])


def run(q: Any, p: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """To the times of the rows."""
    taylor = integrator()
    taylor.time, taylor.state[:] = 0.0, np.concatenate([q, p])
    rows = taylor.propagate_grid(np.arange(steps // every + 1) * every * h)[-1]
    return rows[:, : len(q)], rows[:, len(q) :]
