"""galpy's orbits in its Hénon–Heiles potential, in C with steps of constant length."""

from __future__ import annotations

from typing import Any

import numpy as np
from galpy.orbit import Orbit
from galpy.potential import HenonHeilesPotential


def run(method: str, q: Any, p: Any, h: float, steps: int, every: int, system: Any) -> Any:
    """`steps` steps of the length h; orbits are given and read in polar coordinates."""
    (x, y), (u, v), r = q, p, np.hypot(*q)
    orbit = Orbit([r, (x * u + y * v) / r, (x * v - y * u) / r, np.arctan2(y, x)])
    times = np.arange(steps + 1) * h  # of rows that are further apart it would round the number
    orbit.integrate(times, HenonHeilesPotential(), method=method, dt=h, progressbar=False)
    r, speed, turning, angle = orbit.getOrbit()[::every].T
    c, s = np.cos(angle), np.sin(angle)
    places = np.array([r * c, r * s]).T
    speeds = np.array([speed * c - turning * s, speed * s + turning * c]).T
    places[0], speeds[0] = q, p
    return places, speeds
