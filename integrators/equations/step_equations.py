"""Everything that is derived of one step: its rows on (x, μ), and its arrows if it has some.

What does not exist is None, so nobody has to ask of which kind the equations are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from inspect import unwrap
from typing import Any

from ..compiler import Kind, Step, kinds_of
from ..errors import BadInput, CannotMeasure, line_of
from ..numbers import Graph, Node, Scope, symbols_of, uncollected
from ..numbers.types import Column, Entries, Expression, Letters, SymbolicMatrix
from ..rules import Discretisation, adjoint
from ..scene import Scene
from .arrows import Arrows
from .checks import check_known, check_regular
from .discrete_lagrangian import DiscreteLagrangian
from .on_group import Element
from .rule_view import name_constants
from .symbols import SceneSymbols, column, vector


class StepEquations:
    """One step by a rule, derived from a scene's functions: symbolic, exact, without values.

    Attributes: x, u, y, v, h, columns of the letters in `s`; z = (x, μ), (n+m)×1. unknowns: the
    columns of w with their kinds. rows, which vanish at w, and increment, the growth of z, are
    nodes in z, w, h and the held nodes of `scope`, which differentiates them.
    """

    #: L_d with its Legendre maps on arrows (x, u), without constraints; None if there is no L_d
    discrete: Arrows | None = None
    #: these equations without the constraints of the scene; None if it has none
    free: StepEquations | None = None
    #: True if a step solves no equation
    explicit = False
    #: a mark of equations that share step and groupoid with others (`DiscreteEquations.altered`)
    mark = ""
    unknowns: Sequence[tuple[Kind, Column]]
    rows: list[Node]
    increment: list[Node]
    scope: Scope

    def __init__(self, s: SceneSymbols, rule: Discretisation) -> None:
        self.s, self.rule, self.groupoid = s, rule, s.groupoid
        self.x, self.u, self.y, self.v, self.h = s.x, s.u, s.y, s.v, s.h
        self.z = column([*s.x, *s.mu])

    @property
    def state(self) -> Column:
        """The state of a step: only x for a degenerate Lagrangian, as μ is ϑ(x)."""
        return self.s.x if self.s.degenerate else self.z

    @property
    def arrows(self) -> Arrows | None:
        """`discrete` if a step is a map of arrows (x, u) ↦ (y, v), on which Ω is defined."""
        return self.discrete if self.free is None else None

    @property
    def element(self) -> Element | None:
        """The group element if L_d is a function of it."""
        return None if self.arrows is None else self.arrows.element

    def arrows_for(self, name: str) -> Arrows:
        """Return the arrows, of which `name` is asked; raises `CannotMeasure` if there are none."""
        if self.arrows is None:
            raise self.refused(name)
        return self.arrows

    def refused(self, name: str) -> CannotMeasure:
        """Return the refusal of `name`, an attribute of arrows."""
        raise NotImplementedError

    def check_regular(self, scene: Scene, rule: Discretisation) -> None:
        """Raise `BadInput` if a step does not determine its unknowns anywhere."""

    @property
    def adjoint(self) -> StepEquations:
        """The equations of the adjoint rule, whose step is the inverse of Φ₋ₕ."""
        raise self.refused("adjoint")

    @cached_property
    def w(self) -> Column:
        """The unknowns of a step."""
        return column(e for _, letters in self.unknowns for e in letters)

    @cached_property
    def slope(self) -> SymbolicMatrix:
        """∂(rows)/∂w, square."""
        return self.total(self.rows, self.w)

    def total(self, entries: Entries, variable: Letters) -> SymbolicMatrix:
        """Return d(entries)/d(variable) through all letters; the variable is part of w or z."""
        return self.scope.total(entries, variable)

    @property
    def graph(self) -> Graph:
        """The graph of the letters for held nodes."""
        return self.scope.graph

    @cached_property
    def fields(self) -> tuple[SymbolicMatrix, ...]:
        """The groupoid's own matrices: those of the Poisson tensor, or ρ, L, R of the arrows."""
        return self.groupoid.rho(self.x, self.h), *self.groupoid.structure_functions(self.x, self.h)

    @cached_property
    @uncollected()
    def step(self) -> Step:
        """One step as data for the compiler."""
        n = len(self.x)
        slope = self.scope.jacobian(self.rows, self.graph.letters(self.w))
        return self._step(
            w=tuple(self.w),
            kinds=kinds_of(*self.unknowns),
            rows=self.rows,
            slope=slope,
            increment=self.increment[:n],
            gain=self.increment[n:],
            wanted=(0,) * len(self.rows),
            explicit=self.explicit,
        )

    def _step(self, **more: Any) -> Step:
        s = self.s
        return Step(
            name=s.name, q=tuple(s.q), x=tuple(s.x), u=tuple(s.u), mu=tuple(s.mu), y=tuple(s.y),
            constants=dict(s.constants), graph=self.graph, **more,
        )  # fmt: skip


@lru_cache(maxsize=512)
def composed_step(equations: StepEquations, adjoint: StepEquations | None = None) -> Step:
    """Return the step of a composition; adjoint: the equations of its adjoint substeps, if any."""
    return replace(equations.step, composed=True, adjoint=None if adjoint is None else adjoint.step)


# The equations of a rule with a discrete Lagrangian, whose step is a map of arrows.


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
    def rows(self) -> list[Node]:  # type: ignore[override]
        """E/h − (μ, 0), which vanishes at w."""
        return self.graph.minus(self.step.rows, self.step.wanted)

    @property
    def increment(self) -> list[Node]:  # type: ignore[override]
        """(y − x, (F⁺ − F⁻)/h), n+m."""
        return [*self.step.increment, *self.step.gain]

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
            slope=maps.slope_of_rows,
            gain=maps.gain_of_rows,
            increment=maps.increment,
            scaled=tuple(u for u in self.u if u in used),
            extents=tuple(self.groupoid.extents(self.x, self.u, self.h)),
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
