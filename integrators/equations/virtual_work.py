"""The virtual work of a scene's force in a step, point by point, from what a rule asks for alone.

Where the rule asks for L at (b(x, w; h′), ξ) with a weight, the force f(x_i, ξ) acts with the same
weight, and a e→ + c e← of the arrow displaces that point, in left trivialisation, by

    c_i = L(x, w; h′)⁻¹ ((h′/h) ∂w/∂u (R(x, u) a + L(x, u) c) − R(x, w; h′) a).

Nothing here is made of `LegendreMaps`: this is what the force in F± is held against.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ..numbers import jacobian, sympy
from ..numbers.types import Column, FieldPair
from .discrete_lagrangian import DiscreteLagrangian
from .rule_view import answers_of, written
from .symbols import column


@dataclass(frozen=True, eq=False)
class ForcePoint:
    """A point of a step where the force acts: `point` (n×1) and the weighted `force` there (m×1),
    written out in (x, u, s; h)."""

    of: DiscreteLagrangian
    asked: Column
    point: Column
    force: Column

    @cached_property
    def displacement(self) -> FieldPair:
        """How a and c displace the point, in left trivialisation, m×m each."""
        s, g, one = self.of.s, self.of.groupoid, sympy.eye(len(self.of.s.u))
        R, L = g.R(s.x, s.u, s.h), g.L(s.x, s.u, s.h)
        if g.kind == "pair":
            by_x, by_u = (jacobian(self.point[: s.n, :], e) for e in (s.position, s.u))
            return by_u / s.h - by_x, by_u / s.h
        if self.point == s.x:
            return -one, 0 * one
        given = answers_of(self.asked, self.of.G.Target)
        assert given is not None  # any other point has been refused
        n, h = len(s.x), given[-1]
        base, w = (column(map(written, part)) for part in (given[:n], given[n:-1]))
        back, moved, start = g.inverse_left(base, w, h), jacobian(w, s.u), g.R(base, w, h)
        right, left = (h / s.h * back * moved * field for field in (R, L))
        if base == s.x:
            return right - back * start, left
        return right, left + back * start  # the base is the end of the step


def force_points(of: DiscreteLagrangian) -> list[ForcePoint]:
    """Every point of a step where the force acts."""
    s, n, found = of.s, len(of.s.x), []
    for weight, call in of.asked:
        asked = column(call.args[:n])
        place = [written(e) for e in call.args]
        force = s.force.xreplace(dict(zip([*s.x, *s.u], place, strict=True)))
        found.append(ForcePoint(of, asked, column(place[:n]), written(weight) * force))
    return found


def discrete_force(of: DiscreteLagrangian) -> tuple[Column, Column]:
    """(f⁻, f⁺): what the force adds to F⁻/h and F⁺/h at an arrow and its stages, m×1 each."""
    minus = plus = 0 * of.s.u
    for acting in force_points(of):
        right, left = acting.displacement
        minus, plus = minus + right.T * acting.force, plus + left.T * acting.force
    return minus, plus
