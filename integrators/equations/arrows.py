"""From one discrete Lagrangian to everything derived from it (paper, sections 2 and 3).

L_d is kept as a weighted sum of placed terms (`terms`), in letters for points and chart values.
Results in these letters are small and go to the kernels (`legendre_maps`); here they are written
out in (x, u; h), as in the paper.

With stages a scheme is the system F⁻(x, u, s) = hμ, ∂L_d/∂s = 0. Objects on (x, u) alone (FL, W, Ω)
are Schur complements: s follows x and u.
"""

from __future__ import annotations

from functools import cached_property

from ..numbers import sympy
from ..numbers.types import Column, Expression, SymbolicMatrix
from ..rules import Discretisation
from .checks import check_letters
from .discrete_lagrangian import DiscreteLagrangian
from .legendre_maps import LegendreMaps
from .on_group import Element
from .symbols import SceneSymbols, vector


class Arrows:
    """L_d of a scene and a rule of one step, and the objects derived from it on arrows (x, u).

    of: the discrete Lagrangian if it is derived already.
    """

    def __init__(
        self, s: SceneSymbols, rule: Discretisation, of: DiscreteLagrangian | None = None
    ) -> None:
        self.s, self.rule = s, rule
        if of is not None:
            self.of, self.at_points = of, LegendreMaps(of)

    @cached_property
    def of(self) -> DiscreteLagrangian:
        """The discrete Lagrangian, as a weighted sum of placed terms."""
        return DiscreteLagrangian(self.s, self.rule)

    @cached_property
    def at_points(self) -> LegendreMaps:
        """The Legendre maps in letters for points."""
        maps = LegendreMaps(self.of)
        check_letters(maps, self.rule)
        return maps

    @property
    def element(self) -> Element | None:
        """The group element if L_d is a function of it."""
        return self.of.element if self.s.given is not None else None

    @property
    def rho(self) -> SymbolicMatrix:
        """ρ(x), n×m."""
        return self.at_points.rho

    @property
    def L(self) -> SymbolicMatrix:
        """L(x, u), m×m: its columns are the left-invariant fields."""
        return self.at_points.L

    @property
    def R(self) -> SymbolicMatrix:
        """R(x, u), m×m: the fibre parts of the right-invariant fields."""
        return self.at_points.R

    # -- the theory's objects, written out in (x, u; h) ------------------------------------------

    @cached_property
    def discrete_lagrangian(self) -> Expression:
        """L_d(x, u; h), or L_d(x, u, s; h) before the stages s are eliminated."""
        return self.written_out(sympy.Matrix([self.at_points.discrete_lagrangian]))[0]

    @cached_property
    def L_at_translate(self) -> SymbolicMatrix:
        """L(x, u) at τ(hu) B, if L_d is given on the group (`Element.left`), m×m."""
        return self.L if self.element is None else self.element.left

    @cached_property
    def legendre_minus(self) -> Column:
        """F⁻_γ = e→_γ(L_d), m×1 (paper, remark in section 2.5), with the part of a force."""
        return self.written_out(self.at_points.minus)

    @cached_property
    def legendre_plus(self) -> Column:
        """F⁺_γ = e←_γ(L_d), m×1 (paper, remark in section 2.5), with the part of a force."""
        return self.written_out(self.at_points.plus)

    @cached_property
    def stage_equations(self) -> Column:
        """∂L_d/∂s, which vanish, k·m×1 (none without stages)."""
        return self.written_out(self.at_points.stage_equations)

    @cached_property
    def residual(self) -> Column:
        """F⁺(x, u) − F⁻(b(x, u), v), m×1 in (x, u, v, h): λ of the paper's section 3.5.

        With stages also in s and r, the stages of this step and of the next.
        """
        s = self.s
        end = self.written_out(self.at_points.target)
        after = [*s.v, *end, *vector("r", len(s.stages))]
        pairs = zip([*s.u, *s.x, *s.stages], after, strict=True)
        return self.legendre_plus - self.legendre_minus.xreplace(dict(pairs))

    @cached_property
    def FL(self) -> SymbolicMatrix:
        """(FL)^γ_μ = −∂F⁻_μ/∂u^γ in row γ, column μ, m×m (paper, section 3.5).

        With stages it is the derivative along ∂L_d/∂s = 0, still written in (x, u, s). With a force
        it is that of the forced F⁻: FL decides whether a step is regular, and is not only L_d's.
        """
        maps, stages = self.at_points, self.s.stages

        def by(column: Column, variable: Column) -> SymbolicMatrix:
            return self.written_out(maps.total(column, variable))

        slope = by(maps.minus, self.s.u)
        if len(stages):
            equations = maps.stage_equations
            slope -= by(maps.minus, stages) * by(equations, stages).LUsolve(by(equations, self.s.u))
        return -slope.T

    @cached_property
    def W(self) -> SymbolicMatrix:
        """W_γμ = e←_μ(e→_γ(L_d)) = −L^θ_μ (FL)^θ_γ, m×m (paper, section 3.5).

        With a force it is e←_μ(F⁻_γ) of the forced F⁻, which is not a mixed derivative of L_d.
        """
        return -self.FL.T * self.L

    @cached_property
    def omega(self) -> SymbolicMatrix:
        """Ω on sections a^γ e→_γ + c^γ e←_γ in the order (a, c), 2m×2m: [[0, W], [−Wᵀ, 0]].

        With a force it is that of the forced F⁻, like W: then it is not closed, and no step need
        keep it.
        """
        zero = sympy.zeros(len(self.s.u))
        return sympy.BlockMatrix([[zero, self.W], [-self.W.T, zero]]).as_explicit()

    def written_out(self, matrix: SymbolicMatrix) -> SymbolicMatrix:
        """Return the matrix with every letter replaced by its value in (x, u, s; h).

        If L_d is given on the group, g = τ(hu): the translate is B = e.
        """
        written = self.at_points.of.graph.written_out(matrix)
        return written.xreplace(self.s.identity_translate)
