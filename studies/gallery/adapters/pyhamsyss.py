"""pyHamSys on a scene H = p²/2 + V(q), split into its two parts."""

from __future__ import annotations

from typing import Any

import numpy as np
from pyhamsys import Parameters, solve_ivp_symp


def run(method: str, q: Any, p: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """To the times of the rows, with the step h that is asked for."""
    n, still, z = len(q), np.zeros_like(p), np.concatenate([q, p])

    def moved(h: float, z: np.ndarray) -> np.ndarray:
        return np.concatenate([z[:n] + h * z[n:], z[n:]])

    def kicked(h: float, z: np.ndarray) -> np.ndarray:
        return np.concatenate([z[:n], z[n:] - h * system.gradient(z[:n], still)])

    rows = solve_ivp_symp(
        lambda h, t, z: moved(h, kicked(h, z)), lambda h, t, z: kicked(h, moved(h, z)),
        (0.0, steps * h), z, np.arange(steps // every + 1) * every * h,
        Parameters(step=h, solver=method),
    ).y.T  # fmt: skip
    return rows[:, :n], rows[:, n:]
