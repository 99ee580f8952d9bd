"""The equations of a rule with a discrete Lagrangian, whose step is a map of arrows."""

from __future__ import annotations

from functools import cached_property
from inspect import unwrap
from typing import Any

from ..compiler import Step, kinds_of
from ..errors import BadInput, line_of
from ..groupoids import chart_extents
from ..numbers import Node, Scope, symbols_of, uncollected
from ..numbers.types import Expression, Letters, SymbolicMatrix
from ..rules import Discretisation, adjoint
from ..scene import Scene
from .arrows import Arrows
from .checks import check_known, check_regular
from .discrete_lagrangian import DiscreteLagrangian
from .rule_view import name_constants
from .step_equations import StepEquations
from .symbols import SceneSymbols, vector


class DiscreteEquations(StepEquations):
    """The equations of a scene's functions and a rule of one step.

    of: the discrete Lagrangian if it is derived already. Raises `BadInput` if the rule or the
    Lagrangian cannot be evaluated, or if L_d contains unknown letters, no u, or not every stage.
    L_d of a rule of ours with stages on nodes is derived on first use: runs may not need it
    (`stage_equations`), and its possible errors are those of the Lagrangian.
    """

    discrete: Arrows

    def __init__(
        self, s: SceneSymbols, rule: Discretisation, of: DiscreteLagrangian | None = None
    ) -> None:
        super().__init__(s, rule)
        self.unknowns = [("velocity", s.u), ("stage", s.stages)]
        self.discrete = Arrows(s, rule, of)
        if of is not None:
            return
        if rule.nodes is None or s.given is not None or s.clocked or line_of(unwrap(rule.formula)):
            self.discrete.of  # noqa: B018 - derived, and what is wrong is said, at once
        else:
            check_known(symbols_of([s.lagrangian]), s, rule)
            name_constants(rule, s)  # runs have values for all letters

    def altered(self, mark: str, **maps: SymbolicMatrix) -> DiscreteEquations:
        """Return these equations with other matrices for some of the Legendre maps (`Arrows`).

        They serve seeded faults: these maps need not be those of one L_d. mark: a name that keeps
        results of the altered equations on disk apart from others.
        """
        other = DiscreteEquations(self.s, self.rule, self.discrete.of)
        other.discrete, other.mark = self.discrete.altered(**maps), mark
        return other

    @cached_property
    def adjoint(self) -> DiscreteEquations:
        """The equations of the adjoint rule, whose step is the inverse of Φ₋ₕ."""
        return DiscreteEquations(self.s.for_another_rule(), adjoint(self.rule))

    def check_regular(self, scene: Scene, rule: Discretisation) -> None:
        """Raise `BadInput` if FL or the mass matrix is singular everywhere (`checks`)."""
        check_regular(self, scene, rule)

    @property
    def scope(self) -> Scope:  # type: ignore[override]
        """The letters of L_d."""
        return self.discrete.of.scope

    @property
    def fields(self) -> tuple[SymbolicMatrix, ...]:
        """The groupoid's own matrices: ρ, L, R."""
        return self.discrete.rho, self.discrete.L, self.discrete.R

    @property
    def rows(self) -> list[Node]:
        """E/h − (μ, 0), which vanishes at w."""
        nodes = self.step.nodes
        return self.graph.minus(nodes.rows, nodes.wanted)

    @property
    def increment(self) -> list[Node]:
        """(y − x, (F⁺ − F⁻)/h), n+m."""
        return [*self.step.nodes.increment, *self.step.nodes.gain]

    @cached_property
    @uncollected()
    def step(self) -> Step:
        """The rows, their derivative and the update of a step, all divided by h."""
        maps, element = self.discrete, self.element
        on_group = dict[str, Any]()
        if element is not None:
            on_group = {"along": self._along_group(), "branch": element.branch}
        used = self.discrete.L.free_symbols
        return self._step(
            w=tuple(self.w),
            kinds=kinds_of(*self.unknowns),
            rows=maps.rows,
            slope=[e for row in maps.slope_of_rows for e in row],
            increment=maps.increment,
            gain=maps.gain_of_rows,
            scaled=tuple(u for u in self.u if u in used),
            extents=tuple(chart_extents(self.groupoid, self.x, self.u, self.h)),
            **on_group,
        )

    def _along_group(self) -> tuple[Letters, tuple[Expression, ...]]:
        """Return dw with τ(h(w + dw)) = τ(hc) τ(hw): the correction c of g, followed in the group.

        Newton in the chart alone fails near its edge (Moser–Veselov, rotations spread over the
        group, from the last step: it finds 55 of 100 steps; followed in the group 99).
        """
        groupoid: Any = self.groupoid
        if not groupoid.tau.has_translates:
            raise BadInput(
                f"{self.s.name}: a discrete Lagrangian given on the group runs in "
                "Cayley's chart and its translates; write retraction=cayley."
            )
        letters = vector("c_of_g", len(self.w))
        product = groupoid.product(self.x, letters, self.w, self.h)
        return tuple(letters), tuple(product - self.w)
