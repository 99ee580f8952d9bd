"""Units of a control problem in which its unknowns, multipliers and cost are near 1."""

from __future__ import annotations

import numpy as np

from ...numbers.types import Matrix, Vector
from .stages import ControlStages

#: relative to the largest of its kind: if a groupoid mixes components, a smaller number may be the
#: round-off of others (of rates, times the number of steps), so it has no unit of its own
NOISE = 2.0**-20


def units_of(
    stages: ControlStages, z0: np.ndarray, z1: np.ndarray, guess: tuple[Matrix, ...], t: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return (a unit for each letter of ℒ, the unit of the cost): powers of two, for exact scaling.

    Each component of x, μ and the velocity has the size that it has in the first guess. These and
    the duration T determine a unit of force, μ/T divided by the effect of a control of 1, and the
    cost of that; κ·E and p·z are costs. If nothing moves in the guess, velocities are x/T.
    """
    at, n, m = stages.slices, stages.n, stages.m
    z, _, v = guess
    states, T, steps = np.vstack([z0, z, z1]), t[-1], len(t) - 1
    x, u = sizes(states[:, :n]), sizes(v[:, :m])
    if not u.any():
        u = x / T if n == m and x.any() else np.full(m, (x.max(initial=0) or 1.0) / T)
    if not x.any():
        x = u * T if n == m else np.full(n, u.max() * T)
    noise = 0.0 if stages.s.groupoid.canonical else NOISE
    x, u = shared(x, noise), shared(u, noise)
    mu = sizes(states[:, n:])
    if not mu.any():
        moved = stages.along(np.repeat(states[:1, :n], 2, axis=0), np.stack([0 * u, u]), t[[0, 0]])
        mu = sizes(np.diff(moved[0], axis=0))
    mu = shared(mu, noise)
    a = np.zeros((steps, at["p"].stop))
    a[:, at["x"]], a[:, at["mu"]] = states[:-2, :n], states[:-2, n:]
    a[:, at["w"]] = v[:, : at["w"].stop - at["w"].start]
    count = (at["w"].stop - at["w"].start) // m  # u, then each stage
    effects = np.abs(stages.gains(a, t[:-1], T / steps)).max(axis=0, initial=0)
    gains = effects * steps / np.tile(mu, count + 1)[:, None]
    f = np.array([1 / e if 0 < e < np.inf else 1.0 for e in gains.max(axis=0)])
    still = stages.cost(a, t[:-1], T / steps)[0]
    a[:, at["f"]] = f
    whole = stages.cost(a, t[:-1], T / steps)[0]
    cost = shared(sizes((whole - still)[:, None]) or sizes(whole[:, None]), 0)[0]
    x, mu, u, f, cost = map(powers, (x, mu, u, f, cost))
    units = np.ones(at["p"].stop)
    for name, values in {"x": x, "mu": mu, "w": np.tile(u, count), "f": f,
                         "kappa": cost / np.tile(mu, count),
                         "p": cost / np.append(x, mu)}.items():  # fmt: skip
        units[at[name]] = values
    return units, float(cost)


def sizes(columns: np.ndarray) -> np.ndarray:
    """Return the largest finite absolute value of each column, or 0 if there is none."""
    return np.where(np.isfinite(columns), abs(columns), 0).max(axis=0, initial=0)


def shared(values: np.ndarray, noise: float) -> np.ndarray:
    """Return sizes of one kind; those that are 0 or may be noise become the largest."""
    most = values.max(initial=0) or 1.0
    return np.where(values > noise * most, values, most)


def powers(values: Vector) -> Vector:
    """Return the powers of two nearest to positive numbers."""
    return 2.0 ** np.round(np.log2(values))
