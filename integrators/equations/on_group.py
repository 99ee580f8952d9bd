"""Discrete Lagrangians given on the group itself, usable at any element (paper, section 4).

L_d(x, g) is a function of the element g, an N×N matrix. Its entries are letters: a chart and a
bisection only say how g is written in u. For a translate B of the group

    g = τ(hu) B,     e→_γ g = h e_γ g,     e←_γ g = h g e_γ

so F⁻ and F⁺ hold g alone, and no translate changes the equations. B and B⁻¹ are parameters of the
kernel: another translate changes numbers, never code.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

from ..errors import BadInput
from ..groupoids import LieGroup, Motion, RetractionGroupoid
from ..numbers import Node, Scope, sympy
from ..numbers.types import Column, Expression, SymbolicMatrix
from ..rules import Discretisation
from ..scene import OnGroup
from .rule_view import LagrangianForRule
from .symbols import SceneSymbols
from .terms import Point, place_point


class Element:
    """The letters of g, their values τ(hu) B, and their derivatives along the invariant fields.

    Raises `BadInput` unless the groupoid is a matrix group or an action of one, with real matrices.
    """

    def __init__(self, lagrangian: OnGroup, s: SceneSymbols) -> None:
        self.given, self.s = lagrangian, s
        self.groupoid: Any = s.groupoid
        if not isinstance(s.groupoid, RetractionGroupoid) or s.groupoid.algebra.is_complex:
            raise BadInput(
                f"{s.name}: {s.groupoid.name} has no real group elements; a discrete "
                "Lagrangian on the group needs lie_group(...) or action(...) with real matrices, "
                "such as su(2).real."
            )
        self.size = s.groupoid.algebra.size
        self.g = s.matrix("g", self.size)

    @cached_property
    def fields(self) -> tuple[SymbolicMatrix, SymbolicMatrix]:
        """(h e_γ g, h g e_γ) as columns, N²×m each: e→ and e← on the letters."""
        h, basis = self.s.h, self.groupoid.algebra.matrices
        right = [(h * e * self.g).reshape(self.size**2, 1) for e in basis]
        left = [(h * self.g * e).reshape(self.size**2, 1) for e in basis]
        return sympy.Matrix.hstack(*right), sympy.Matrix.hstack(*left)

    def placed(self, scope: Scope, u: list[Node]) -> Point:
        """Return the letters of g, which stand for τ(hu) B, with ∂g/∂u = (e→ g) R⁻¹."""
        s, groupoid, size = self.s, self.groupoid, self.size**2
        value = groupoid.element(s.u, s.h) * s.translate[0]
        inverse_right = groupoid.tau.inverse_right_field(groupoid.algebra, s.h * s.u)
        point = place_point(scope, self.g.reshape(size, 1), value.reshape(size, 1), u, [])
        slope = self.fields[0] * inverse_right
        point.move(Motion(sympy.eye(size), slope, *self.fields))
        return point

    @cached_property
    def left(self) -> SymbolicMatrix:
        """Columns: the left-invariant fields at g = τ(hu) B in the chart's u, L(u) Ad_B, m×m."""
        algebra, (B, inverse) = self.groupoid.algebra, self.s.translate
        adjoint = [algebra.coordinates(B * e * inverse) for e in algebra.matrices]
        return self.groupoid.L(self.s.x, self.s.u, self.s.h) * sympy.Matrix.hstack(*adjoint)

    def discrete_lagrangian(self, rule: Discretisation) -> Expression:
        """Return L_d of `own`, or of its adjoint, in the letters of g, expanded."""
        return rule.formula(LagrangianForRule(self.s), self, self.s.x, self.g, self.s.h)

    @cached_property
    def branch(self) -> Expression:
        """Return the number that identifies a solution (`OnGroup`), in x and the letters of g."""
        s, function = self.s, self.given.branch or self.given.formula
        return s.call(function, "its branch", s.x, self.g, s.h, s.parameters)

    def target(self, x: Column, g: SymbolicMatrix, h: Expression) -> Column:
        """Return x·g, n×1."""
        return x if isinstance(self.groupoid, LieGroup) else self.groupoid.moved(x, g)

    def inversion(self, x: Column, g: SymbolicMatrix, h: Expression) -> SymbolicMatrix:
        """Return −g⁻¹: a rule takes −ι as the u of the inverse arrow."""
        adjugate = g.adjugate()
        if all(e.trace() == 0 for e in self.groupoid.algebra.matrices):
            return -adjugate  # det g = 1
        return -adjugate / g.det()
