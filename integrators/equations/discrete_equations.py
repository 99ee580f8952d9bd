"""From one discrete Lagrangian to everything that is derived from it (paper, sections 2 and 3).

L_d is kept as a weighted sum of placed terms (`terms`), in letters for points and chart values.
What is derived in these letters is small and goes to the kernels (`legendre_maps`); here it is
written out in (x, u; h), as the paper has it.

With stages a scheme is the system F⁻(x, u, s) = hμ, ∂L_d/∂s = 0. What is derived on (x, u) alone
(FL, W, Ω) are Schur complements: s follows x and u.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

from ..errors import BadInput, line_of
from ..groupoids import check_axioms
from ..numbers import first_violation, sympy, written_out
from ..rules import Composition, Discretisation, own
from ..scene import OnGroup, Scene
from .chain_rule import Block
from .checks import check_letters, check_regular, check_start
from .discrete_lagrangian import DiscreteLagrangian
from .legendre_maps import LegendreMaps
from .on_group import Element
from .rule_view import (
    GroupoidForRule,
    LagrangianForRule,
    WrittenGroupoid,
    WrittenLagrangian,
    written,
)
from .symbols import SceneSymbols


class DiscreteEquations:
    """What is derived from a scene and a rule, symbolic and exact.

    Attributes: x, u (columns n×1, m×1), y, v (x and u of the next step), h, and `s` with the
    parameters' symbols. Raises `BadInput` if the groupoid violates its axioms, the rule or the
    Lagrangian cannot be evaluated, or L_d is degenerate (FL singular everywhere).
    """

    def __init__(self, scene: Scene, rule: Discretisation) -> None:
        if not isinstance(scene, Scene):
            raise BadInput(f"{scene!r} is no scene: give a Scene, or scenes.get(name).")
        if not isinstance(rule, Discretisation):
            raise BadInput(f"{rule!r} is no rule: decorate the function with @discretisation().")
        check_axioms(scene.groupoid)
        if scene.discrete_lagrangian is not None and not isinstance(rule, Composition):
            rule = own  # no rule has a say where L_d is given
        self.scene, self.rule = scene, rule
        #: what the kernels depend on besides L_d and the groupoid: nothing, as long as nobody
        #: changes what is derived (`studies.power` does, to see whether that is noticed)
        self.mark = ""
        self.s = s = SceneSymbols(scene, rule.stages)
        self.x, self.u, self.y, self.v, self.h = s.x, s.u, s.y, s.v, s.h
        groupoid = scene.groupoid
        of = DiscreteLagrangian(s, groupoid)
        #: the group element, where L_d is a function of it
        self.element: Element | None = None
        #: whether the rule takes velocities from curves, and so serves every chart alike
        self.gave_velocities = False
        if isinstance(scene.discrete_lagrangian, OnGroup):
            self.element = g = Element(scene.discrete_lagrangian, groupoid, s)
            of.add_element(g.block)
            of.give(g.expression(g.given.formula, "its discrete Lagrangian"))
        elif scene.discrete_lagrangian is not None:
            given = s.call(
                scene.discrete_lagrangian, "its discrete Lagrangian", s.x, s.u, s.h, s.parameters
            )
            of.give(given)
        else:
            s.lagrangian  # noqa: B018 - a wrong Lagrangian is named before the rule
            L, G = LagrangianForRule(s), GroupoidForRule(groupoid, s)
            of.give(self._value_of_rule(L, G), L, G)
            self.gave_velocities = G.gave_velocities
        self.at_points = LegendreMaps(of, self.element)
        #: the points b(x, u; θh) of the straight step that L_d holds
        self.points: tuple[Block, ...] = of.points
        #: what a step solves for: u, then the stages
        self.w = s.u.col_join(s.stages) if rule.stages else s.u
        check_letters(self.at_points, scene, rule)
        check_start(s, scene)
        check_regular(self.at_points, self.w, scene, rule)
        #: the one that was derived: this one, or the one that `Scheme.at` was asked of
        self.origin = self

    def _value_of_rule(self, L: LagrangianForRule, G: GroupoidForRule) -> Any:
        """What the rule gives for the answers of L and G, if it only uses them; else written out.

        A rule of ours only uses them. A user's may look into them, so it is asked twice.
        """
        s, rule = self.s, self.rule
        more = [s.x, s.u, s.h, *([s.stage_columns] if rule.stages else [])]
        what = f"rule {rule.name}"
        if not line_of(rule.formula):
            return s.call(rule.formula, what, L, G, *more)
        plain = [WrittenLagrangian(s), WrittenGroupoid(self.scene.groupoid, s)]
        wanted = s.call(rule.formula, what, *plain, *more)
        try:
            value = s.call(rule.formula, what, L, G, *more)
            difference = written(value) - wanted
            if first_violation([difference], [*s.u, *s.stages, s.h]) is None:
                return value
        except BadInput:  # it asked for what an answer does not have, and an expression has
            pass
        return wanted

    # -- the theory's objects, written out in (x, u; h) ----------------------------------------

    @cached_property
    def discrete_lagrangian(self) -> Any:
        """L_d(x, u; h), or L_d(x, u, s; h) before the stages s are eliminated."""
        return self.written_out(sympy.Matrix([self.at_points.discrete_lagrangian]))[0]

    @property
    def rho(self) -> Any:
        """ρ(x), n×m."""
        return self.at_points.rho

    @property
    def L(self) -> Any:
        """L(x, u), m×m: columns are the left-invariant fields."""
        return self.at_points.L

    @cached_property
    def L_at_translate(self) -> Any:
        """L(x, u) at τ(hu) B, where L_d is given on the group (`Element.left`), m×m."""
        return self.L if self.element is None else self.element.left

    @property
    def R(self) -> Any:
        """R(x, u), m×m: columns are the fibre parts of the right-invariant fields."""
        return self.at_points.R

    @cached_property
    def legendre_minus(self) -> Any:
        """F⁻_γ = e→_γ(L_d), m×1 (paper, remark in section 2.5)."""
        return self.written_out(self.at_points.minus)

    @cached_property
    def legendre_plus(self) -> Any:
        """F⁺_γ = e←_γ(L_d), m×1 (paper, remark in section 2.5)."""
        return self.written_out(self.at_points.plus)

    @cached_property
    def stage_equations(self) -> Any:
        """∂L_d/∂s, which vanish, k·m×1 (none without stages)."""
        return self.written_out(self.at_points.stage_equations)

    @cached_property
    def residual(self) -> Any:
        """F⁺(x, u) − F⁻(b(x, u), v), m×1 in (x, u, v, h): λ of the paper's section 3.5.

        With stages also in s and r, the stages of this step and of the next.
        """
        s = self.s
        end = self.written_out(self.at_points.target)
        after = [*self.v, *end, *s.vector("r", len(s.stages))]
        pairs = zip([*self.u, *self.x, *s.stages], after, strict=True)
        return self.legendre_plus - self.legendre_minus.subs(list(pairs), simultaneous=True)

    @cached_property
    def FL(self) -> Any:
        """(FL)^γ_μ = −∂F⁻_μ/∂u^γ in row γ, column μ, m×m (paper, section 3.5).

        With stages the derivative along ∂L_d/∂s = 0, still written in (x, u, s).
        """
        maps, stages = self.at_points, self.s.stages

        def by(column: Any, variable: Any) -> Any:
            return self.written_out(maps.total(column, variable))

        slope = by(maps.minus, self.u)
        if len(stages):
            equations = maps.stage_equations
            slope -= by(maps.minus, stages) * by(equations, stages).LUsolve(by(equations, self.u))
        return -slope.T

    @cached_property
    def W(self) -> Any:
        """W_γμ = e←_μ(e→_γ(L_d)) = −L^θ_μ (FL)^θ_γ, m×m (paper, section 3.5)."""
        return -self.FL.T * self.L

    @cached_property
    def omega(self) -> Any:
        """Ω on sections a^γ e→_γ + c^γ e←_γ in the order (a, c), 2m×2m: [[0, W], [−Wᵀ, 0]]."""
        zero = sympy.zeros(len(self.u))
        return sympy.BlockMatrix([[zero, self.W], [-self.W.T, zero]]).as_explicit()

    def written_out(self, expression: Any) -> Any:
        """The expression (or matrix) with every letter replaced by its value in (x, u, s; h).

        Where L_d is given on the group, g = τ(hu), the translate by B = e.
        """
        definitions = self.at_points.definitions(expression)
        return written_out(definitions, expression).xreplace(self.s.identity_translate)
