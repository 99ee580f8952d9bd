"""The arrow of several steps, one after another, and the velocity of a curve of arrows at e."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from ..numbers import sympy
from ..numbers.types import Column, Expression, Expressions, Letter


@dataclass(frozen=True)
class ComposedArrows:
    """The arrow of all steps from x, in terms of the arrow before the last step and of that step.

    letters: what the arrow before is made of: hu of pairs, the entries of group elements, and chart
    coordinates where a groupoid is known by its product alone. begin: their values at e. after:
    their values behind the step u, in `letters`, u, h, the x of that step and that of the first
    (`origin`). velocity: the ξ at x
    of a curve of arrows through e, in its derivative there (in `letters`) and x.
    """

    letters: Expressions
    begin: list[int]
    after: Expressions
    velocity: Expressions


@lru_cache(maxsize=256)
def composed_arrows(groupoid: Any) -> ComposedArrows:
    """Return how arrows of a groupoid are composed."""
    s = groupoid.symbols
    return _composed(groupoid, s["x"], s["u"], s["h"], 0)


def _composed(groupoid: Any, x: Column, u: Column, h: Expression, first: int) -> ComposedArrows:
    before = _letters(len(u), first)
    if groupoid.canonical:
        return ComposedArrows(list(before), [0] * len(u), list(before + h * u), list(before))
    if groupoid.parts:
        places, fibres = groupoid.base(x), groupoid.fibre(u)
        connected = groupoid.connection is not None
        if connected:  # ξ of the group, of which the fibre has ξ + A(x) ẋ
            ((_, turn),) = groupoid.group_parts(x, u, h)
            fibres = fibres[0], turn / h
        arrows = list[ComposedArrows]()
        for part, place, fibre in zip(groupoid.parts, places, fibres, strict=True):
            behind = first + sum(len(e.letters) for e in arrows)
            arrows.append(_composed(part, place, fibre, h, behind))
        one, other = arrows
        turning = other.velocity
        if connected:
            moved = sympy.Matrix(groupoid.connection(x)) * sympy.Matrix(one.velocity)
            turning = list(sympy.Matrix(turning) + moved)
        return ComposedArrows(
            [*one.letters, *other.letters], [*one.begin, *other.begin],
            [*one.after, *other.after], [*one.velocity, *turning],
        )  # fmt: skip
    if not hasattr(groupoid, "algebra"):
        after = h * groupoid.product(
            sympy.Matrix(len(x), 1, list(map(origin, x))), before / h, u, h
        )
        return ComposedArrows(list(before), [0] * len(u), list(after), list(before))
    algebra = groupoid.algebra.real
    N = algebra.size
    g = _letters(N * N, first).reshape(N, N)
    after, dual = g * groupoid.tau.element(algebra, h * u), algebra.dual
    entries = sympy.Matrix(N * N, 1, list(g))
    return ComposedArrows(list(g), list(map(int, sympy.eye(N))), list(after), list(dual * entries))


def origin(x: Letter) -> Letter:
    """Return the letter for an entry of x where the first of several steps begins."""
    return sympy.Symbol(f"a{x}".replace("_", ""), real=True)


def _letters(count: int, first: int = 0) -> Column:
    return sympy.Matrix([sympy.Symbol(f"ar{first + i}", real=True) for i in range(count)])
