"""Impulses in Coulomb's cones: P_n ≥ 0, U_n ≥ 0, P_n U_n = 0; |P_t| ≤ κ P_n, opposite to the slip.

As roots of the natural map, min(P_n, r U_n) and P_t − proj(P_t − r U_t) on the disc of the radius
κ P_n: sweeps of Gauss and Seidel over the contacts find who touches and who slips, a semismooth
Newton method the rest. Where contacts are redundant its matrix is singular, and sweeps go on.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..errors import CannotMeasure
from ..numbers import Arithmetic
from ..numbers.types import Number, Vector

NOT_FOUND = "no impulses of the contacts were found"
SWEEPS, CORRECTIONS = 2000, 12
ROUNDED = 64  # units of round-off that are left of a solution


class Cones(NamedTuple):
    """Contacts: so many normal impulses, and behind them those of the planes with friction.

    planes: of a normal impulse by its place, where those of its plane are, and its coefficient κ.
    """

    normals: int
    planes: dict[int, tuple[slice, Number]]


def of_parts(values: Vector, cones: Cones) -> Vector:
    """The size of each normal and of each plane: what is along the plane says nothing of the other,
    so each is held against its own."""
    normals = abs(values[: cones.normals])
    planes = [max(abs(values[t])) for t, _ in cones.planes.values()]
    return np.append(normals, planes) if planes else normals


def residual(P: Vector, U: Vector, r: Vector, cones: Cones) -> Vector:
    """The natural map, in units of an impulse."""
    found = P - np.maximum(0 * P, P - r * U)
    for n, (t, bound) in cones.planes.items():
        found[t] = P[t] - _on_disc(P[t] - r[t] * U[t], bound * max(0 * P[n], P[n]))
    return found


def scaling(W: Any, cones: Cones) -> Vector:
    """r, an impulse for a velocity: one of the normal, one of the plane of each contact.

    Raises `CannotMeasure` where an impulse does not move its own contact the way it pushes.
    """
    own = W.diagonal()
    if not (own > 0).all():
        raise CannotMeasure("friction jams a contact, which no impulse opens (Painlevé's paradox)")
    r = 1 / own
    for t, _ in cones.planes.values():
        r[t] = 1 / sum(own[t])
    return r


def impulses(W: np.ndarray, U0: Vector, cones: Cones, numbers: Arithmetic, start: Vector) -> Vector:
    """P with U = U₀ + W P in the cones, near `start` where contacts are redundant.

    Raises `CannotMeasure` where none is found.
    """
    r, P = scaling(W, cones), start.copy()
    if solved(P, U0, W, r, cones, numbers):
        return P
    for sweep in range(SWEEPS):
        for n in range(cones.normals):
            P[n] = max(0 * P[n], P[n] - r[n] * (U0[n] + W[n] @ P))
            if n in cones.planes:
                t, bound = cones.planes[n]
                P[t] = _on_disc(P[t] - r[t] * (U0[t] + W[t] @ P), bound * P[n])
        if sweep < 10 or not sweep % 50:
            if solved(P, U0, W, r, cones, numbers):
                return P
            found = _newton(W, U0, r, P, cones, numbers)
            if found is not None and solved(found, U0, W, r, cones, numbers):
                return found
    raise CannotMeasure(NOT_FOUND)


def solved(P: Vector, U0: Vector, W: Any, r: Vector, cones: Cones, numbers: Arithmetic) -> bool:
    """Whether P are the impulses, to round-off."""
    left = abs(residual(P, U0 + W @ P, r, cones))
    unit = ROUNDED * numbers.eps * (abs(P) + r * (abs(U0) + abs(W) @ abs(P)))
    return bool((of_parts(left, cones) <= of_parts(unit, cones)).all())


def _newton(
    W: np.ndarray, U0: Vector, r: Vector, P: Vector, cones: Cones, numbers: Arithmetic
) -> Vector | None:
    for _ in range(CORRECTIONS):
        U = U0 + W @ P
        slope = numbers.identity(len(P))
        pushing = np.flatnonzero((r * U < P)[: cones.normals])
        slope[pushing] = r[pushing, None] * W[pushing]
        for n, (t, bound) in cones.planes.items():
            z, radius = P[t] - r[t] * U[t], bound * max(0 * P[n], P[n])
            size = length(z)
            inner = -r[t][:, None] * W[t]
            inner[:, t] += numbers.identity(len(z))
            if size > radius:
                along = z / size
                inner = (radius / size) * (inner - np.outer(along, along @ inner))
                inner[:, n] += along * bound
            slope[t] -= inner
        try:
            step = numbers.solve(slope, residual(P, U, r, cones))
        except ZeroDivisionError:
            return None
        P = P - step
        if max(abs(step), default=0) <= ROUNDED * numbers.eps * max(abs(P), default=0):
            break
    return P


def _on_disc(z: Vector, radius: Number) -> Vector:
    """The nearest point of the disc of a radius."""
    size = length(z)
    return z if size <= radius else z * (radius / size)


def length(v: Vector) -> Number:
    """|v|, in any arithmetic."""
    return sum(e * e for e in v) ** 0.5
