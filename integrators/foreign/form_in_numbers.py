"""The Poisson form, the symplectic form and volume under a map of numbers, with what is certain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..numbers import Matrix, Vector
from .differences import EPS, FARTHEST, Derivative, Map, Noise, images

LOOP = 64  # points of a closed curve
UNRESOLVED = 1e-3  # of its amplitudes at the highest frequencies: its points do not resolve it


@dataclass(frozen=True)
class Defect:
    """A defect relative to the terms that it is made of.

    certain: what remains of it beyond the errors of the derivative; 0 if these explain it all.
    measured: the largest. resolution: the largest that these errors may hide. entry: of the worst.
    """

    certain: float
    measured: float
    resolution: float
    entry: tuple[int, ...] = ()


def form_defect(of: Derivative, before: Matrix, after: Matrix) -> Defect:
    """How far M Π Mᵀ is from Π′, M (k, l), Π before (l, l), Π′ after (k, k).

    Each entry relative to the sum of its absolute terms, or, if that is larger, to the natural unit
    of the pair: with the sizes of entries that M and Π′ themselves give, so that bodies of very
    different mass do not drown.
    """
    M, E = of.value, of.error
    size = np.abs(M) @ np.abs(before) @ np.abs(M).T + np.abs(after)
    gap = np.abs(M @ before @ M.T - after)
    half = E @ np.abs(before) @ (np.abs(M) + E / 2).T
    unsure = half + half.T + 4 * len(before) * EPS * size
    return _worst(gap, unsure, np.maximum(size, _natural(size)))


def pulled_back_defect(of: Derivative, start: Derivative, form: Any) -> Defect:
    """How far Dᵀ ω D is from Nᵀ ω N: D and N the derivatives of a map and of where it starts from,
    (2n, l) each, in parameters of the submanifold on which ω = dq ∧ dp is looked at."""
    w, absolute = np.asarray(form), np.abs(form)
    gap = np.abs(of.value.T @ w @ of.value - start.value.T @ w @ start.value)
    size = unsure = np.zeros_like(gap)
    for part in (of, start):
        a, e = np.abs(part.value), part.error
        size = size + a.T @ absolute @ a
        half = e.T @ absolute @ (a + e / 2)
        unsure = unsure + half + half.T
    return _worst(gap, unsure + 4 * len(w) * EPS * size, np.maximum(size, _natural(size)))


def volume_defect(of: Derivative, growth: float = 1.0) -> Defect:
    """How far det M is from `growth`, relative to 1; the error by the inverse of M."""
    value = abs(float(np.linalg.det(of.value)))
    try:
        inverse = np.abs(np.linalg.inv(of.value))
    except np.linalg.LinAlgError:
        return Defect(1.0, 1.0, float("inf"))
    unsure = value * float(np.trace(inverse @ of.error)) + 8 * len(of.value) * EPS * value
    gap = abs(value - growth)
    return Defect(max(0.0, gap - unsure), gap, unsure)


def _natural(size: Matrix) -> Matrix:
    """The natural unit of each pair of entries: a thousandth of the geometric mean of the largest
    that either has, below which an entry is no part of the motion."""
    most = np.sqrt(size.max(axis=1))
    return 1e-3 * np.outer(most, most)


def _worst(gap: Matrix, unsure: Matrix, size: Matrix) -> Defect:
    with np.errstate(all="ignore"):
        size = np.where(size > 0, size, 1.0)
        certain = np.maximum(gap - unsure, 0) / size
        certain[~np.isfinite(certain)] = 0.0
        shares = np.where(np.isfinite(unsure), unsure / size, np.inf)
        measured = np.where(np.isfinite(gap), gap / size, 0.0)
    at = np.unravel_index(int((certain if certain.max() else measured).argmax()), gap.shape)
    return Defect(
        float(certain.max(initial=0.0)),
        float(measured.max(initial=0.0)),
        float(shares.max(initial=0.0)),
        tuple(map(int, at)),
    )


def loop_defect(f: Map, curve: Matrix, n: int, noise: Noise) -> Defect:
    """How far ∮ p·dq is from what it was, over the closed curve of starts (r, 2n), after f.

    By Fourier derivatives, which are exact for a curve that 64 points resolve: no derivative of the
    map (Poincaré's integral invariant). Relative to ∮ |p·dq| about the mean of p, per degree of
    freedom. What is not resolved is told by every second point.
    """
    image = images(f, curve)
    if not np.isfinite(image).all():
        return Defect(0.0, 0.0, float("inf"))
    found = [_integral(rows, n) for rows in (curve, image)]
    coarse = [_integral(rows[::2], n) for rows in (curve, image)]
    size = max(found[0][1], found[1][1])
    rough = np.maximum(noise.level, EPS * np.abs(image).max(axis=0)) * FARTHEST + noise.jump
    dq = np.abs(np.diff(image[:, :n], axis=0, append=image[:1, :n])).max(axis=0)
    p = np.abs(image[:, n:] - image[:, n:].mean(axis=0)).max(axis=0)
    # each value's noise, by the other's derivative; those of 64 points are independent
    of_noise = float((rough[n:] * dq + rough[:n] * p * np.pi).sum()) * len(curve) ** 0.5
    tails = max(a[2] for a in found)
    if tails > UNRESOLVED:
        return Defect(0.0, 0.0, float("inf"))
    beyond = sum(abs(a[0] - b[0]) for a, b in zip(found, coarse, strict=True))
    unsure = of_noise + beyond + size * tails
    gap = abs(found[1][0] - found[0][0])
    size = size or 1.0
    return Defect(max(0.0, gap - unsure) / size, gap / size, unsure / size)


def _integral(rows: Matrix, n: int) -> tuple[float, float, float]:
    """(∮ p·dq, its absolute terms, how much of the curve is at the highest frequencies)."""
    p = rows[:, n:] - rows[:, n:].mean(axis=0)
    slopes, tail = slopes_and_tail(np.hstack([rows[:, :n], p]))
    terms = p * slopes[:, :n] * (2 * np.pi / len(rows))
    return float(terms.sum()), float(np.abs(terms).sum()), tail


def slopes_and_tail(rows: Matrix) -> tuple[Matrix, float]:
    """The derivative (r, l) along a closed curve (r, l) by its Fourier series, and how much of the
    curve is at the highest frequencies."""
    r = len(rows)
    spectrum = np.fft.fft(rows, axis=0)
    k = np.fft.fftfreq(r, 1 / r)
    k[r // 2] = 0
    slopes = np.fft.ifft(1j * k[:, None] * spectrum, axis=0).real
    with np.errstate(all="ignore"):
        high = np.abs(spectrum[r // 2 - 3 : r // 2 + 4]).max(axis=0)
        tail = np.nanmax(np.where(high > 0, high / np.abs(spectrum[1:]).max(axis=0), 0.0))
    return slopes, float(tail)


def random_curve(random: Any, z: Vector, scale: Vector, reach: float) -> Matrix:
    """A closed curve of `LOOP` points around z, (r, 2n), with three harmonics."""
    t = 2 * np.pi * np.arange(LOOP) / LOOP
    a, b, c = (random.standard_normal(len(z)) * scale * reach for _ in range(3))
    return z + np.outer(np.cos(t), a) + np.outer(np.sin(t), b) + 0.3 * np.outer(np.cos(2 * t), c)
