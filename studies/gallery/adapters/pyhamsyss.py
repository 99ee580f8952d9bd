"""pyHamSys on a scene H = p²/2 + V(q), split into its two parts."""

from __future__ import annotations

from typing import Any

import numpy as np
from pyhamsys import Parameters, solve_ivp_symp


def run(method: str, q: Any, p: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """To the times of the rows by steps of h.

    Between two of r rows it makes ⌈T/step⌉ ÷ r + 1 steps, so a larger `step` is asked for, and a
    row more, since it makes at least two steps.
    """
    count = steps // every + 1
    n, still, z = len(q), np.zeros_like(p), np.concatenate([q, p])

    def moved(h: float, z: np.ndarray) -> np.ndarray:
        return np.concatenate([z[:n] + h * z[n:], z[n:]])

    def kicked(h: float, z: np.ndarray) -> np.ndarray:
        return np.concatenate([z[:n], z[n:] - h * system.gradient(z[:n], still)])

    rows = solve_ivp_symp(
        lambda h, t, z: moved(h, kicked(h, z)), lambda h, t, z: kicked(h, moved(h, z)),
        (0.0, count * every * h), z, np.linspace(0.0, count * every * h, count + 1),
        Parameters(step=h * every / (every - 0.75), solver=method),
    ).y.T[:-1]  # fmt: skip
    return rows[:, :n], rows[:, n:]
