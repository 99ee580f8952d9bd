"""Impulses in Coulomb's cones: P_n ≥ 0, U_n ≥ 0, P_n U_n = 0; |P_t| ≤ κ P_n, opposite to the slip.

As roots of the natural map, min(P_n, r U_n) and P_t − proj(P_t − r U_t) on the disc of the radius
κ P_n: sweeps of Gauss and Seidel over the contacts find who touches and who slips, a semismooth
Newton method the rest. Where contacts are redundant its matrix is singular, and sweeps go on.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..errors import CannotMeasure
from ..numbers import Arithmetic
from ..numbers.types import Number, Vector

NOT_FOUND = "no impulses of the contacts were found"
SWEEPS, CORRECTIONS = 2000, 12
ROUNDED = 64  # units of round-off that are left of a solution


class Cone(NamedTuple):
    """Where the impulse of a contact stands, and its coefficient κ of friction."""

    normal: int
    tangent: slice
    bound: Number


def parts(cones: Sequence[Cone]) -> list[slice]:
    """The normal and the plane of each contact: what is along the plane says nothing of the other,
    so each is held against its own size."""
    return [part for c in cones for part in (slice(c.normal, c.normal + 1), c.tangent)]


def residual(P: Vector, U: Vector, r: Vector, cones: Sequence[Cone]) -> Vector:
    """The natural map, in units of an impulse."""
    found = P.copy()
    for cone in cones:
        n, t = cone.normal, cone.tangent
        found[n] = P[n] - max(0 * P[n], P[n] - r[n] * U[n])
        found[t] = P[t] - _on_disc(P[t] - r[t] * U[t], cone.bound * max(0 * P[n], P[n]))
    return found


def scaling(W: np.ndarray, cones: Sequence[Cone]) -> Vector:
    """r, an impulse for a velocity: one of the normal, one of the plane of each contact.

    Raises `CannotMeasure` where an impulse does not move its own contact the way it pushes.
    """
    if not (W.diagonal() > 0).all():
        raise CannotMeasure("friction jams a contact, which no impulse opens (Painlevé's paradox)")
    r = 1 / W.diagonal()
    for cone in cones:
        if cone.tangent.start < cone.tangent.stop:
            r[cone.tangent] = 1 / sum(W.diagonal()[cone.tangent])
    return r


def impulses(
    W: np.ndarray, U0: Vector, cones: Sequence[Cone], numbers: Arithmetic, start: Vector
) -> Vector:
    """P with U = U₀ + W P in the cones, near `start` where contacts are redundant.

    Raises `CannotMeasure` where none is found.
    """
    r, P = scaling(W, cones), start.copy()
    if _solved(P, U0, W, r, cones, numbers):
        return P
    for sweep in range(SWEEPS):
        for cone in cones:
            n, t = cone.normal, cone.tangent
            P[n] = max(0 * P[n], P[n] - r[n] * (U0[n] + W[n] @ P))
            if t.start < t.stop:
                P[t] = _on_disc(P[t] - r[t] * (U0[t] + W[t] @ P), cone.bound * P[n])
        if sweep < 10 or not sweep % 50:
            if _solved(P, U0, W, r, cones, numbers):
                return P
            found = _newton(W, U0, r, P, cones, numbers)
            if found is not None and _solved(found, U0, W, r, cones, numbers):
                return found
    raise CannotMeasure(NOT_FOUND)


def _solved(
    P: Vector, U0: Vector, W: np.ndarray, r: Vector, cones: Sequence[Cone], numbers: Arithmetic
) -> bool:
    left = abs(residual(P, U0 + W @ P, r, cones))
    unit = ROUNDED * numbers.eps * (abs(P) + r * (abs(U0) + abs(W) @ abs(P)))
    return all(max(left[part], default=0) <= max(unit[part], default=0) for part in parts(cones))


def _newton(
    W: np.ndarray, U0: Vector, r: Vector, P: Vector, cones: Sequence[Cone], numbers: Arithmetic
) -> Vector | None:
    for _ in range(CORRECTIONS):
        slope = numbers.identity(len(P))
        for cone in cones:
            n, t = cone.normal, cone.tangent
            if P[n] > r[n] * (U0[n] + W[n] @ P):
                slope[n] = r[n] * W[n]
            if t.start == t.stop:
                continue
            z, radius = P[t] - r[t] * (U0[t] + W[t] @ P), cone.bound * max(0 * P[n], P[n])
            length = sum(e * e for e in z) ** 0.5
            inner = -r[t][:, None] * W[t]
            inner[:, t] += numbers.identity(len(z))
            if length > radius:
                along = z / length
                inner = (radius / length) * (inner - np.outer(along, along @ inner))
                inner[:, n] += along * cone.bound
            slope[t] -= inner
        try:
            step = numbers.solve(slope, residual(P, U0 + W @ P, r, cones))
        except ZeroDivisionError:
            return None
        P = P - step
        if max(abs(step), default=0) <= ROUNDED * numbers.eps * max(abs(P), default=0):
            break
    return P


def _on_disc(z: Vector, radius: Number) -> Vector:
    """The nearest point of the disc of a radius."""
    length = sum(e * e for e in z) ** 0.5 if len(z) else 0
    return z if length <= radius else z * (radius / length)
