"""Special motions of the free body in R^4 (Manakov): inside a coordinate R^3, and steady ones.

A velocity that leaves one coordinate axis fixed always leaves it fixed; in the other three the body
is a rigid body with the moments l_i + l_j, and `rigid_body` turns it. Rotations in the coordinate
planes (12) and (34), or in another such pair, are steady. (Manakov 1976; Ratiu, Indiana Univ. Math.
J. 29, 1980.) The general motion needs theta functions of two variables and is integrated.
"""

from __future__ import annotations

from itertools import combinations
from types import SimpleNamespace
from typing import Any

import mpmath
import sympy

from ..equations import number_to_mpf
from . import rigid_body
from .form import ClosedForm, Motion, Numbers, is_zero, sign

PAIRS = list(combinations(range(4), 2))


def lagrangian(x: Any, v: Any, p: Any) -> Any:
    return sum((p.mass[i] + p.mass[j]) * w**2 for (i, j), w in zip(PAIRS, v, strict=True)) / 2


def basis() -> tuple[Any, ...]:
    """Return E_ji - E_ij for i < j."""
    return tuple(
        sympy.Matrix(4, 4, lambda r, c, i=i, j=j: int((r, c) == (j, i)) - int((r, c) == (i, j)))
        for i, j in PAIRS
    )


def _planes(v0: Numbers) -> list[tuple[int, int]]:
    return [pair for pair, w in zip(PAIRS, v0, strict=True) if not is_zero(w)]


def _space(v0: Numbers) -> tuple[int, ...] | None:
    """Return three axes within which the body turns, or None."""
    planes = _planes(v0)
    for axes in combinations(range(4), 3):
        if all(set(pair) <= set(axes) for pair in planes):
            return axes
    return None


def applies(p: Any, x0: Numbers, v0: Numbers) -> bool:
    positive = all(sign(p.mass[i] + p.mass[j]) > 0 for i, j in PAIRS)
    planes = _planes(v0)
    apart = len(planes) == 2 and not set(planes[0]) & set(planes[1])
    return positive and (apart or _space(v0) is not None)


def motion(p: Any, x0: Numbers, v0: Numbers, t: Any) -> Motion:
    axes = _space(v0)
    if axes is None:  # two planes turn at their own speeds
        attitude = mpmath.eye(4)
        for (i, j), w in zip(PAIRS, map(number_to_mpf, v0), strict=True):
            if w:
                attitude[i, i] = attitude[j, j] = mpmath.cos(w * t)
                attitude[j, i] = mpmath.sin(w * t)
                attitude[i, j] = -attitude[j, i]
        return Motion([], [number_to_mpf(w) for w in v0], attitude)
    # the hat map's axes (23), (31), (12) against E_ji - E_ij
    i, j, k = axes
    places = [(PAIRS.index((j, k)), 1), (PAIRS.index((i, k)), -1), (PAIRS.index((i, j)), 1)]
    moments = [p.mass[j] + p.mass[k], p.mass[i] + p.mass[k], p.mass[i] + p.mass[j]]
    inner = rigid_body.motion(
        SimpleNamespace(inertia=moments), [], [s * v0[place] for place, s in places], t
    )
    velocity, attitude = [mpmath.mpf(0)] * 6, mpmath.eye(4)
    for (place, s), w in zip(places, inner.v, strict=True):
        velocity[place] = s * w
    for r, a in enumerate(axes):
        for c, b in enumerate(axes):
            attitude[a, b] = inner.attitude[r, c]
    return Motion([], velocity, attitude)


FORM = ClosedForm(
    "rigid-body-so4", "the rigid body of a coordinate R^3, or a steady rotation", "group",
    lagrangian, motion, applies, basis, attitude=True,
)  # fmt: skip
