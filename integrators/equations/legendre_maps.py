"""F⁻, F⁺ and the equations of a step, with points as letters: small expressions for kernels.

Two facts keep every expression small, on every groupoid:

    e→_γ(f∘β) = 0   and   e←_γ(f∘β) = ρ^i_γ(y) ∂f/∂y^i        (f a function of the base)

so the end point y = b(x, u; h) never has to be differentiated in F⁻ or F⁺: expressions that are
rational in a Cayley chart stay polynomial.
"""

from __future__ import annotations

import itertools
from functools import cached_property
from typing import Any

from ..numbers import Node, opaque, sympy
from ..numbers.types import Column, Expression, SymbolicMatrix
from .discrete_lagrangian import DiscreteLagrangian
from .points import gradient_along
from .symbols import column


class LegendreMaps:
    """A scheme's equations in x, u, s and the letters of its discrete Lagrangian.

    rho (n×m), L and R (m×m) are the groupoid's ρ(x), L(x, u), R(x, u): the columns of L are the
    left-invariant fields, those of R the fibre parts of the right-invariant ones.
    """

    def __init__(self, of: DiscreteLagrangian) -> None:
        self.of, self.element, self.s, self.groupoid = of, of.element, of.s, of.groupoid
        self._altered: frozenset[str] = frozenset()
        s, groupoid = of.s, of.groupoid
        self.rho = groupoid.rho(s.x, s.h)
        self.L, self.R = groupoid.L(s.x, s.u, s.h), groupoid.R(s.x, s.u, s.h)
        #: the object that knows the target, and an arrow in its letters: u in the chart, or g
        self._arrows: tuple[Any, Any] = (groupoid, s.u)
        if self.element is not None:
            self._arrows = self.element, self.element.g

    def altered(self, **maps: SymbolicMatrix) -> LegendreMaps:
        """Return these maps with other matrices for those named; the rest is derived anew."""
        other = LegendreMaps(self.of)
        other._altered = frozenset(maps)
        for name, matrix in maps.items():
            setattr(other, name, matrix)
        return other

    @property
    def discrete_lagrangian(self) -> Expression:
        """L_d, in the letters of its points."""
        return self.of.expression

    @cached_property
    def _derived(self) -> dict[str, list[Node]]:
        """Return F⁻, F⁺, F⁺ − F⁻ and ∂L_d/∂s as nodes."""
        of, graph = self.of, self.of.graph
        of_x, of_u, stages, of_moved = of.gradient()
        rho, L, R = map(graph.matrix, (self.rho, self.L, self.R))
        m = len(of_u)
        along_x = graph.plus(graph.transposed(rho, of_x, m), of.turned_x)
        minus = graph.plus(graph.transposed(R, of_u), [-e for e in along_x])
        plus = graph.plus(graph.transposed(L, of_u), of.turned_y)
        # like terms of functions cancel unexpanded: multiplying their factors out would take long
        difference = (self.L - self.R).applyfunc(lambda e: e if opaque(e) else e.expand())
        gain = graph.plus(graph.transposed(graph.matrix(difference), of_u), along_x, of.turned_y)
        for point, gradient in zip(of.moved, of_moved, strict=True):
            if not point.nodes:
                continue
            along = graph.transposed(point.anchor, gradient)
            fields = [*itertools.chain(*point.right)]
            varying = all(any(map(graph.slopes, e)) for e in (fields, gradient))
            if self.element is None and varying:  # it is used many times; g is used by its entries
                along = gradient_along(of.scope, point, gradient, "k", self.s.forced)
            right, left = (graph.transposed(e, along, m) for e in (point.right, point.left))
            minus, plus = graph.plus(minus, right), graph.plus(plus, left)
            apart = [[b - a for a, b in zip(*rows, strict=True)]
                     for rows in zip(point.right, point.left, strict=True)]  # fmt: skip
            gain = graph.plus(gain, graph.transposed(apart, along, m))
            if point.displacement is not None:
                force = of.force_at(point.nodes)
                right, left = (graph.transposed(e, force) for e in point.displacement)
                minus, plus = graph.plus(minus, right), graph.plus(plus, left)
                gain = graph.plus(gain, left, [-e for e in right])
        at_start = of.force_at(of.x)  # the start is displaced by −a
        minus, gain = graph.plus(minus, [-e for e in at_start]), graph.plus(gain, at_start)
        return {"minus": minus, "plus": plus, "gain": gain, "stages": stages}

    @cached_property
    def minus(self) -> Column:
        """F⁻, m×1."""
        return self._shown("minus")

    @cached_property
    def plus(self) -> Column:
        """F⁺, m×1."""
        return self._shown("plus")

    @cached_property
    def gain(self) -> Column:
        """F⁺ − F⁻ with common terms cancelled, m×1: recomputing F⁺ would let momenta drift."""
        return self._shown("gain")

    @cached_property
    def stage_equations(self) -> Column:
        """∂L_d/∂s, which vanish, k·m×1."""
        return self._shown("stages")

    def _shown(self, name: str) -> Column:
        return self._cancelled(self.of.graph.shown_column(self._derived[name]))

    def _cancelled(self, column: SymbolicMatrix) -> SymbolicMatrix:
        """Return the matrix; on the group with polynomials in g, so that x·g − x·g cancels."""
        if self.element is None:
            return column
        letters = list(self.element.g)
        return column.applyfunc(lambda e: e.expand().collect(letters))

    @cached_property
    def system(self) -> Column:
        """E = (F⁻, ∂L_d/∂s): a step solves E = (hμ, 0) for w = (u, s)."""
        stages = self.stage_equations
        return self.minus.col_join(stages) if len(stages) else self.minus

    @cached_property
    def slope(self) -> SymbolicMatrix:
        """∂E/∂w, square."""
        columns = [c for c in (self.s.u, self.s.stages) if len(c)]
        return sympy.Matrix.hstack(*[self.total(self.system, c) for c in columns])

    @cached_property
    def rows(self) -> Column:
        """E/h, in which powers of h cancel before they are ever rounded."""
        return self.per_step(self.system)

    @cached_property
    def slope_of_rows(self) -> SymbolicMatrix:
        """∂(E/h)/∂w, square."""
        if "slope" in self._altered:
            return self.per_step(self.slope)
        return self.total(self.rows, column([*self.s.u, *self.s.stages]))

    def per_step(self, matrix: SymbolicMatrix) -> SymbolicMatrix:
        """Return matrix/h, term by term."""
        graph = self.of.graph
        h = graph.letter(self.s.h)
        return matrix.applyfunc(lambda e: graph.shown(graph.divided(graph.read(e), h)))

    def total(self, column: Column, variable: Column) -> SymbolicMatrix:
        """Return d(column)/d(variable) through all letters; the variable is x, u or s."""
        return self.of.scope.total(column, variable)

    @cached_property
    def minus_along_right(self) -> SymbolicMatrix:
        """e→_γ(F⁻) at a fixed x in column γ, m×m: ∂F⁻/∂u · R, where L_d is given on the group."""
        element = self.element
        assert element is not None
        return self._cancelled(self.minus.jacobian(list(element.g)) * element.fields[0])

    @cached_property
    def target(self) -> Column:
        """y = b(x, u; h), n×1; x·g where L_d is given on the group."""
        arrows, arrow = self._arrows
        return arrows.target(self.s.x, arrow, self.s.h)

    @cached_property
    def increment(self) -> Column:
        """y − x with the difference cancelled, n×1."""
        arrows, arrow = self._arrows
        return arrows.increment(self.s.x, arrow, self.s.h)
