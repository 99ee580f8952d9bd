"""Impulses in Coulomb's cones: P_n ≥ 0, U_n ≥ 0, P_n U_n = 0; |P_t| ≤ κ P_n, opposite to the slip.

They are roots of the natural map: min(P_n, r U_n), and P_t − proj(P_t − r U_t) on the disc of
radius κ P_n. Gauss–Seidel sweeps over the contacts find which ones touch and slip; a semismooth
Newton method does the rest. If contacts are redundant, its matrix is singular, and the shortest
step is taken. If both fail and there are few contacts, each is tried open, sticking and slipping:
that finds solutions from which the sweeps diverge, such as the impulse that stops a rod in
Painlevé's paradox.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np

from ...errors import CannotMeasure
from ...numbers import Arithmetic
from ...numbers.types import MatrixLike, Number, Vector

SWEEPS, CORRECTIONS = 2000, 12
ROUNDED = 64  # largest residual of a solution, in units of round-off
FEW = 3  # up to so many contacts all modes are tried: 4³ linear systems


class NotFound(CannotMeasure):
    """No impulses of the contacts were found; near: the closest impulses of the sweeps."""

    def __init__(self, near: Vector) -> None:
        super().__init__("no impulses of the contacts were found")
        self.near = near


class Jammed(CannotMeasure):
    """An impulse does not open its own contact.

    Either friction of a known slip outweighs it (Painlevé's paradox), or the gap has no slope
    there, or the mass matrix is not positive there.
    """

    def __init__(self) -> None:
        super().__init__("an impulse does not open its own contact, whose gap has no slope there, "
                         "or whose mass is not positive")  # fmt: skip


class Cones(NamedTuple):
    """The contacts: the number of normal impulses, which come first, and the planes with friction.

    planes: index of a normal impulse ↦ (slice of the impulses in its plane, coefficient κ).
    """

    normals: int
    planes: dict[int, tuple[slice, Number]]


def of_parts(values: Vector, cones: Cones) -> Vector:
    """Return the size of each normal entry and of each plane.

    Entries along a plane tell nothing about the normal ones, so each part has its own size.
    """
    normals = abs(values[: cones.normals])
    planes = [max(abs(values[t])) for t, _ in cones.planes.values()]
    return np.append(normals, planes) if planes else normals


def residual(P: Vector, U: Vector, r: Vector, cones: Cones) -> Vector:
    """Return the natural map, in units of an impulse; it is 0 at a solution."""
    gap = P - np.maximum(0 * P, P - r * U)
    for n, (t, bound) in cones.planes.items():
        gap[t] = P[t] - _on_disc(P[t] - r[t] * U[t], bound * max(0 * P[n], P[n]))
    return gap


def missed(P: Vector, U: Vector, r: Vector, cones: Cones) -> Vector:
    """Return the distance of P from the cones, for each part."""
    return of_parts(abs(residual(P, U, r, cones)), cones)


def scaling(W: MatrixLike, cones: Cones) -> Vector:
    """Return r, an impulse per velocity: for each contact one for its normal and one for its plane.

    Raises `Jammed` if an impulse does not move its own contact in the direction in which it pushes.
    """
    own = W.diagonal()
    if not (own > 0).all():
        raise Jammed
    r = 1 / own
    for t, _ in cones.planes.values():
        r[t] = 1 / sum(own[t])
    return r


def impulses(W: np.ndarray, U0: Vector, cones: Cones, numbers: Arithmetic, start: Vector) -> Vector:
    """Return P in the cones with U = U₀ + W P, near `start` if contacts are redundant.

    Raises `NotFound` if no solution is found.
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
        if sweep < 10 or sweep % 50 == 49:
            if solved(P, U0, W, r, cones, numbers):
                return P
            solution = _newton(W, U0, r, P, cones, numbers)
            if solution is not None and solved(solution, U0, W, r, cones, numbers):
                return solution
    if cones.normals <= FEW:
        for guess in _of_modes(W, U0, cones, numbers):
            solution = _newton(W, U0, r, guess, cones, numbers)
            for tried in (guess, solution):
                if tried is not None and solved(tried, U0, W, r, cones, numbers):
                    return tried
    raise NotFound(P)


def _of_modes(W: np.ndarray, U0: Vector, cones: Cones, numbers: Arithmetic) -> Iterator[Vector]:
    """Yield P of each choice of open, sticking and slipping contacts, from one linear system each.

    A slip in a plane with two directions is tried along U₀ and against it, and from there turned
    into the direction of its own solution.
    """
    ways = {n: _unit(U0[t]) for n, (t, _) in cones.planes.items()}
    choices = [("open", "stick") + (("with", "against") if n in ways else ())
               for n in range(cones.normals)]  # fmt: skip
    for modes in product(*choices):
        along = {n: ways[n] if mode == "with" else -ways[n]
                 for n, mode in enumerate(modes) if mode in ("with", "against")}  # fmt: skip
        pushing = [n for n, mode in enumerate(modes) if mode != "open"]
        for _ in range(CORRECTIONS if any(len(e) > 1 for e in along.values()) else 1):
            # P = spread · (the unknown normals, and the impulses of the sticking contacts)
            rows = list(pushing)
            for n in pushing:
                if n in ways and n not in along:
                    rows += range(*cones.planes[n][0].indices(len(U0)))
            spread = numbers.identity(len(U0))[:, rows]
            for n, e in along.items():
                plane, bound = cones.planes[n]
                spread[plane, pushing.index(n)] = -bound * e
            try:
                P = spread @ numbers.solve((W @ spread)[rows], -U0[rows])
            except (ZeroDivisionError, np.linalg.LinAlgError):
                break
            yield P
            U = U0 + W @ P
            along = {n: _unit(U[cones.planes[n][0]]) for n in along}


def _unit(v: Vector) -> Vector:
    """Return v / |v|, or the first unit vector if v is 0."""
    size = length(v)
    if size > 0:
        return v / size
    unit = 0 * v
    unit[0] = unit[0] + 1
    return unit


def solved(
    P: Vector, U0: Vector, W: MatrixLike, r: Vector, cones: Cones, numbers: Arithmetic
) -> bool:
    """Return True if P solves the problem to round-off; for a plane also to that of κ P_n."""
    left = missed(P, U0 + W @ P, r, cones)
    units = of_parts(abs(P) + r * (abs(U0) + abs(W) @ abs(P)), cones)
    for k, (n, (_, bound)) in enumerate(cones.planes.items(), cones.normals):
        units[k] += bound * abs(P[n])
    return bool((left <= ROUNDED * numbers.eps * units).all())


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
        step = _least(slope, residual(P, U, r, cones), r**0.5, numbers)
        if step is None:
            return None
        P = P - step
        if max(abs(step), default=0) <= ROUNDED * numbers.eps * max(abs(P), default=0):
            break
    return P


def _least(slope: np.ndarray, left: Vector, unit: Vector, numbers: Arithmetic) -> Vector | None:
    """Return the least step with slope·step = left in the given units.

    If contacts are redundant, the slope is singular to round-off, and its rows agree. In more than
    16 digits the step is the only one, or None.
    """
    if slope.dtype == object:
        try:
            return numbers.solve(slope, left)
        except ZeroDivisionError:
            return None
    scaled, right = slope * unit / unit[:, None], left / unit
    if not (np.isfinite(scaled).all() and np.isfinite(right).all()):
        return None
    step: Vector = unit * np.linalg.lstsq(scaled, right, rcond=ROUNDED * numbers.eps)[0]
    return step


def _on_disc(z: Vector, radius: Number) -> Vector:
    """Return the nearest point of the disc with the given radius."""
    size = length(z)
    return z if size <= radius else z * (radius / size)


def length(v: Vector) -> Number:
    """Return |v|, in any arithmetic."""
    return sum(e * e for e in v) ** 0.5
