"""F⁻, F⁺ and what a step solves, with points as letters: small expressions, for the kernels.

Two facts keep every expression small, on every groupoid:

    e→_γ(f∘β) = 0   and   e←_γ(f∘β) = ρ^i_γ(y) ∂f/∂y^i        (f a function of the base)

so the end point y = b(x, u; h) never has to be differentiated in F⁻ or F⁺: what is rational in a
Cayley chart stays polynomial.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

from ..numbers import Definition, needed, opaque, replaced, symbols_of, sympy
from ..numbers.types import Column, Expression, Expressions, SymbolicMatrix
from .covectors import times
from .discrete_lagrangian import DiscreteLagrangian
from .point_motion import gradient_along


class LegendreMaps:
    """A scheme's equations in x, u, s and the letters of its discrete Lagrangian.

    rho (n×m), L and R (m×m) are the groupoid's ρ(x), L(x, u), R(x, u): the columns of L are the
    left-invariant fields, those of R the fibre parts of the right-invariant ones.
    """

    def __init__(self, of: DiscreteLagrangian) -> None:
        self.of, self.element, self.s, self.groupoid = of, of.element, of.s, of.groupoid
        s, groupoid = of.s, of.groupoid
        self.rho = groupoid.rho(s.x, s.h)
        self.L, self.R = groupoid.L(s.x, s.u, s.h), groupoid.R(s.x, s.u, s.h)
        #: what knows the target, and an arrow in its letters: u in the chart, or the element g
        self._arrows: tuple[Any, Any] = (groupoid, s.u)
        if self.element is not None:
            self._arrows = self.element, self.element.g
        #: (a map written out, that map in letters of gradients, whose derivatives are known)
        self._forms: list[tuple[Column, Column]] = []

    def altered(self, **maps: SymbolicMatrix) -> LegendreMaps:
        """Other matrices in place of the maps named; what follows from these is derived anew."""
        other = LegendreMaps(self.of)
        for name, matrix in maps.items():
            setattr(other, name, matrix)
        return other

    @property
    def discrete_lagrangian(self) -> Expression:
        """L_d, in the letters of its points."""
        return self.of.expression

    @cached_property
    def _base(self) -> dict[str, Column]:
        """F⁻, F⁺ and F⁺ − F⁻ in all letters, gradients of terms included."""
        s, d, chain, zero = self.s, self.of.covectors, self.of.chain, 0 * self.s.u
        of_u, of_x = d.of(s.u), times(self.rho.T, d.of(s.x)) if len(s.x) else zero
        turned_x = d.turned.get(s.x[0], zero) if len(s.x) else zero
        turned_y = d.turned.get(s.y[0], zero) if len(s.y) else zero
        minus = times(self.R.T, of_u) - of_x - turned_x
        plus = times(self.L.T, of_u) + turned_y
        # like terms of functions cancel as they stand: writing their factors out would take long
        difference = (self.L - self.R).applyfunc(lambda e: e if opaque(e) else e.expand())
        gain = times(difference.T, of_u) + of_x + turned_x + turned_y
        for block in self.of.moved:
            assert block.motion is not None
            anchor, _, right, left = block.motion
            gradient = d.of(block.letters)
            varying = all(symbols_of(e) - set(s.q) for e in (right, gradient))
            along = times(anchor.T, written := self._inlined(gradient))
            if self.element is None and varying:  # asked for many times, and g by its entries
                name = f"k{len(chain.blocks)}"
                along = gradient_along(chain, block, written, name, s.forced)
            minus, plus = minus + times(right.T, along), plus + times(left.T, along)
            gain += times((left - right).T, along)
            if block.displacement is not None:
                force = d.force_at(block.letters, s.u)
                right, left = (times(c.T, force) for c in block.displacement)
                minus, plus, gain = minus + right, plus + left, gain + (left - right)
        at_start = d.force_at(s.x, s.u)  # the start is displaced by −a
        minus, gain = minus - at_start, gain + at_start
        return {"minus": minus, "plus": plus, "gain": gain}

    @cached_property
    def minus(self) -> Column:
        """F⁻, m×1."""
        return self._cancelled(self._base["minus"])

    @cached_property
    def plus(self) -> Column:
        """F⁺, m×1."""
        return self._cancelled(self._base["plus"])

    @cached_property
    def gain(self) -> Column:
        """F⁺ − F⁻ with what they share cancelled, m×1: recomputing F⁺ would let momenta drift."""
        return self._cancelled(self._base["gain"])

    def _cancelled(self, column: SymbolicMatrix) -> SymbolicMatrix:
        """Gradients written out; polynomials in the letters of g too, so that x·g − x·g cancels."""
        written = self._inlined(column)
        if self.element is None:
            self._forms.append((written, column))
            return written
        letters = list(self.element.g)
        return written.applyfunc(lambda e: e.expand().collect(letters))

    def _inlined(self, matrix: SymbolicMatrix) -> SymbolicMatrix:
        if not self.of.inline:
            return matrix
        return sympy.Matrix(*matrix.shape, replaced(matrix, self.of.inline))

    @cached_property
    def stage_equations(self) -> Column:
        """∂L_d/∂s, which vanish, k·m×1."""
        return self.of.covectors.of(self.s.stages)

    @cached_property
    def system(self) -> Column:
        """E = (F⁻, ∂L_d/∂s): what a step solves for w = (u, s), against (hμ, 0)."""
        stages = self.stage_equations
        return self.minus.col_join(stages) if len(stages) else self.minus

    @cached_property
    def slope(self) -> SymbolicMatrix:
        """∂E/∂w, square."""
        columns = [c for c in (self.s.u, self.s.stages) if len(c)]
        parts = [p for p in (self.minus, self.stage_equations) if len(p)]
        rows = [sympy.Matrix.hstack(*[self.total(p, c) for c in columns]) for p in parts]
        return sympy.Matrix.vstack(*rows)

    def total(self, column: Column, variable: Column) -> SymbolicMatrix:
        """d(column)/d(variable) through all letters; the variable is x, u or s."""
        in_letters = next((form for written, form in self._forms if written is column), column)
        return self._inlined(self.of.chain.total(in_letters, variable))

    def definitions(self, *uses: Expressions) -> list[Definition]:
        """What the letters in the expressions stand for, in order."""
        return needed(self.of.chain.definitions(), [e for use in uses for e in use])

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
