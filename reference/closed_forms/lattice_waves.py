"""Solutions of lattices and of fields in closed form, as arrays of double precision.

Toda's chain: M. Toda, J. Phys. Soc. Japan 22 (1967); G. Teschl, Jahresber. Dtsch. Math.-Ver. 103
(2001), equation (1.8). The sine-Gordon equation: G. L. Lamb, Elements of Soliton Theory (1980), 5.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Field = tuple[np.ndarray, np.ndarray]  # values and their time derivatives, (N,) each


def toda_solitons(
    sites: np.ndarray, t: float, kappa: Sequence[float], at: Sequence[float]
) -> Field:
    """Return (x, ẋ) of solitons of ẍ_n = e^(x_{n−1} − x_n) − e^(x_n − x_{n+1}), at sites n (N,).

    kappa: one per soliton, positive to the right, negative to the left; its speed is sinh κ/κ, its
    height 2κ. at: the place where each would be at t = 0 if it were alone.
    """
    k, sign = np.abs(np.array(kappa, float)), np.sign(kappa)
    weights = 1 / (1 - sign[:, None] * sign * np.exp(-(k[:, None] + k)))

    def tau(n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return log det(1 + C), and its time derivative."""
        phase = -k * (n[:, None] - np.array(at, float)) + sign * np.sinh(k) * t
        bound = np.minimum(phase, 0)  # rows and columns are scaled so that nothing overflows
        grown = np.exp(bound)
        left = np.exp(-2 * np.maximum(phase, 0))
        C = weights * grown[:, :, None] * grown[:, None, :]
        A = C + left[:, :, None] * np.eye(len(k))
        rate = sign * np.sinh(k)
        slope = C * (rate[:, None] + rate)
        change = np.trace(np.linalg.solve(A, slope), axis1=1, axis2=2)
        return np.linalg.slogdet(A)[1] + 2 * np.maximum(phase, 0).sum(axis=1), change

    (here, of_here), (before, of_before) = tau(sites), tau(sites - 1)
    return -(here - before), -(of_here - of_before)


def sine_gordon_kink(places: np.ndarray, t: float, speed: float) -> Field:
    """Return (φ, φ_t) of 4 atan exp(γ(x − ct)), where c is the speed and γ = 1/√(1 − c²)."""
    gamma = 1 / np.sqrt(1 - speed**2)
    phase = gamma * (places - speed * t)
    return 4 * np.arctan(np.exp(phase)), -2 * gamma * speed / np.cosh(phase)


def sine_gordon_breather(places: np.ndarray, t: float, frequency: float) -> Field:
    """Return (φ, φ_t) of the breather at rest, 4 atan(√(1 − ω²) cos ωt / (ω cosh(√(1 − ω²) x)))."""
    width = np.sqrt(1 - frequency**2)
    over = width / (frequency * np.cosh(width * places))
    value, slope = over * np.cos(frequency * t), -frequency * over * np.sin(frequency * t)
    return 4 * np.arctan(value), 4 * slope / (1 + value**2)


def toda_shift(kappa: float, others: np.ndarray) -> np.ndarray:
    """Return how many sites each crossed soliton shifts a soliton of Toda's chain, (K,).

    It is ln |(1 − z z′)/(z − z′)| / |κ| with z = ±e^(−|κ|), the sign that of κ: forward, if they
    meet head-on or it is the faster one; otherwise backward.
    """
    z, w = (np.sign(k) * np.exp(-np.abs(k)) for k in (kappa, np.asarray(others, float)))
    return np.asarray(np.log(np.abs((1 - z * w) / (z - w))) / abs(kappa))


def toda_places(x: np.ndarray, kappa: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return the places in x (N,) of the solitons with these |κ|, (K,).

    Each must be alone within 8 sites of `near`. From e^(x_n − x_{n+1}) = 1 + sinh²κ/cosh²(κ(n + 1/2
    − X)) at the bonds beside the highest.
    """
    heights, places = np.expm1(-np.diff(x)), []
    for k, guess in zip(np.abs(kappa), near, strict=True):
        around = np.arange(round(guess) - 8, round(guess) + 9)
        top = int(around[np.argmax(heights[around])])
        away = [np.arccosh(np.sinh(k) / np.sqrt(heights[n])) / k for n in (top - 1, top + 1)]
        places.append(top + 0.5 + (away[0] - away[1]) / 2)
    return np.array(places)


def toda_traces(x: np.ndarray, p: np.ndarray, most: int) -> np.ndarray:
    """Return tr Lᵐ/N, m = 1 … most, of Lax's matrix of a ring with springs e^(−r) + r − 1.

    L has b = p/2 on the diagonal and a = e^((x_n − x_{n+1})/2)/2 beside it (Flaschka, Phys. Rev. B
    9 (1974), 1924); the traces are equivalent to Hénon's integrals. Needs N > 2·most; O(most² N).
    """
    b, a = p / 2, np.exp((x - np.roll(x, -1)) / 2) / 2
    below = np.roll(a, 1)
    power = {0: np.ones_like(b)}  # offset j − i: the entries (i, i + offset)
    traces = []
    for _ in range(most):
        grown: dict[int, np.ndarray] = {}
        for offset, entries in power.items():
            for step, column in ((0, b), (1, a), (-1, below)):
                moved = entries * np.roll(column, -offset)
                grown[offset + step] = grown.get(offset + step, 0) + moved
        power = grown
        traces.append(power[0].mean())
    return np.array(traces)
