"""F⁻, F⁺ and what a step solves, with the points as atoms: small expressions, for the kernels.

Two facts keep every expression small, on every groupoid:

    e→_γ(f∘β) = 0   and   e←_γ(f∘β) = ρ^i_γ(y) ∂f/∂y^i        (f a function of the base)

so the end point y = b(x, u; h) never has to be differentiated in F⁻ or F⁺: what is rational in a
Cayley chart stays polynomial.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

from ..numbers.lazy import sympy
from ..numbers.multi_output import opaque
from .chain_rule import Adjoints

if TYPE_CHECKING:
    from .discrete_equations import DiscreteEquations


class AtPoints:
    """A scheme's equations in x, u, s and the letters of its atoms (`chain_rule`).

    `discrete_lagrangian`: L_d, with the points (and velocities) that its rule asked for as letters.
    """

    def __init__(self, scheme: DiscreteEquations, discrete_lagrangian: Any) -> None:
        self.scheme, self.discrete_lagrangian = scheme, discrete_lagrangian

    @cached_property
    def _adjoints(self) -> Adjoints:
        return self.scheme.chain.adjoints(self.discrete_lagrangian)

    @cached_property
    def minus(self) -> Any:
        """F⁻, m×1."""
        scheme, d = self.scheme, self._adjoints
        result = scheme.R.T * d.u - scheme.rho.T * d.x
        for point, d_z in d.at_points:
            result += point.moved[0].T * d_z
        for point, part in d.turned:
            result -= part if point.base == scheme.x else 0 * part
        return self._cancelled(result)

    @cached_property
    def plus(self) -> Any:
        """F⁺, m×1."""
        scheme, d = self.scheme, self._adjoints
        result = scheme.L.T * d.u
        for point, d_z in d.at_points:
            result += point.moved[1].T * d_z
        for point, part in d.turned:
            result += part if point.base == scheme.y else 0 * part
        return self._cancelled(result)

    @cached_property
    def gain(self) -> Any:
        """F⁺ − F⁻ with what they share cancelled, m×1: recomputing F⁺ would let momenta drift."""
        scheme, d = self.scheme, self._adjoints
        # like terms of functions cancel as they stand: writing their factors out would take long
        difference = (scheme.L - scheme.R).applyfunc(lambda e: e if opaque(e) else e.expand())
        result = difference.T * d.u + scheme.rho.T * d.x
        for point, d_z in d.at_points:
            right, left = point.moved
            result += (left - right).T * d_z
        for _, part in d.turned:
            result += part
        return self._cancelled(result)

    def _cancelled(self, column: Any) -> Any:
        """Polynomials in the letters of g written out, so that h/h and x·g − x·g cancel."""
        element = self.scheme.element
        if element is None:
            return column
        letters = list(element.g)
        return column.applyfunc(lambda e: e.expand().collect(letters))

    @cached_property
    def stage_equations(self) -> Any:
        """∂L_d/∂s, which vanish, k·m×1."""
        return self._adjoints.s

    @cached_property
    def system(self) -> Any:
        """E = (F⁻, ∂L_d/∂s): what a step solves for w = (u, s), against (hμ, 0)."""
        stages = self.stage_equations
        return self.minus.col_join(stages) if len(stages) else self.minus

    @cached_property
    def slope(self) -> Any:
        """∂E/∂w, square."""
        scheme = self.scheme
        columns = [c for c in (scheme.u, scheme.s.stages) if len(c)]
        return sympy.Matrix.hstack(*[scheme.chain.total(self.system, c) for c in columns])

    @cached_property
    def minus_along_right(self) -> Any:
        """e→_γ(F⁻) at a fixed x in column γ, m×m: ∂F⁻/∂u · R, where L_d is given on the group."""
        element = self.scheme.element
        return self._cancelled(self.minus.jacobian(list(element.g)) * element.fields[0])

    @cached_property
    def target(self) -> Any:
        """y = b(x, u; h), n×1; x·g where L_d is given on the group."""
        scheme = self.scheme
        if scheme.element is not None:
            return scheme.element.target(scheme.x)
        return scheme.scene.groupoid.target(scheme.x, scheme.u, scheme.h)

    @cached_property
    def increment(self) -> Any:
        """y − x with the difference cancelled, n×1."""
        scheme = self.scheme
        if scheme.element is not None:
            return scheme.element.increment(scheme.x)
        return scheme.scene.groupoid.increment(scheme.x, scheme.u, scheme.h)
