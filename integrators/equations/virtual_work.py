"""The virtual work of a scene's force in a step, point by point, from a rule's calls of L.

If the rule calls L at (b(x, w; h′), ξ) with a weight, the force f(x_i, ξ) acts with the same
weight, and a e→ + c e← of the arrow displaces that point, in left trivialisation, by

    c_i = L(x, w; h′)⁻¹ ((h′/h) (∂w/∂u (R(x, u) a + L(x, u) c) + ∂w/∂s δs) − R(x, w; h′) a).

`Arrows` are not used here: the force in F± is compared with this.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ..numbers import jacobian, sympy
from ..numbers.types import Column, SymbolicMatrix
from .discrete_lagrangian import DiscreteLagrangian
from .rule_view import answers_of, written
from .symbols import column


@dataclass(frozen=True, eq=False)
class ForcePoint:
    """A point of a step where the force acts.

    `point` (n×1) and the weighted `force` there (m×1) are written out in (x, u, s; h).
    """

    of: DiscreteLagrangian
    asked: Column
    point: Column
    force: Column

    @cached_property
    def displacement(self) -> tuple[SymbolicMatrix, SymbolicMatrix, SymbolicMatrix]:
        """Displacements of the point by a, c and δs, left-trivialised: m×m, m×m and m×(stages)."""
        s, g, one = self.of.s, self.of.groupoid, sympy.eye(len(self.of.s.u))
        stages, count = s.stages, len(s.stages)
        R, L = g.R(s.x, s.u, s.h), g.L(s.x, s.u, s.h)
        none = sympy.zeros(len(s.u), 0)
        if g.canonical:
            place = self.point[: s.n, :]
            by_x, by_u = (jacobian(place, e) for e in (s.position, s.u))
            return by_u / s.h - by_x, by_u / s.h, jacobian(place, stages) / s.h if count else none
        if self.point == s.x:
            return -one, 0 * one, sympy.zeros(len(s.u), count)
        arguments = answers_of(self.asked, self.of.G.Target)
        assert arguments is not None  # any other point has been refused
        n, h = len(s.x), arguments[-1]
        base, w = (column(map(written, part)) for part in (arguments[:n], arguments[n:-1]))
        back, moved, start = g.inverse_left(base, w, h), jacobian(w, s.u), g.R(base, w, h)
        right, left = (h / s.h * back * moved * field for field in (R, L))
        bent = h / s.h * back * jacobian(w, stages) if count else none
        if base == s.x:
            return right - back * start, left, bent
        return right, left + back * start, bent  # the base is the end of the step


def force_points(of: DiscreteLagrangian) -> list[ForcePoint]:
    """Return every point of a step where the force acts."""
    s, n, points = of.s, len(of.s.x), []
    for weight, call in of.asked:
        asked = column(call.args[:n])
        place = [written(e) for e in call.args]
        force = s.force.xreplace(dict(zip([*s.x, *s.u], place, strict=True)))
        points.append(ForcePoint(of, asked, column(place[:n]), written(weight) * force))
    return points


def discrete_force(of: DiscreteLagrangian) -> tuple[Column, Column, Column]:
    """Return the force's part of F⁻/h, F⁺/h and ∂L_d/∂s / h at an arrow and its stages.

    They are m×1, m×1 and one entry per stage's.
    """
    parts = [0 * of.s.u, 0 * of.s.u, sympy.zeros(len(of.s.stages), 1)]
    for acting in force_points(of):
        for i, moved in enumerate(acting.displacement):
            parts[i] += moved.T * acting.force
    minus, plus, stages = parts
    return minus, plus, stages
