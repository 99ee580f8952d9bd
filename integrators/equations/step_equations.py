"""Everything that is derived of one step: its rows on (x, μ), and its arrows if it has some.

What does not exist is None, so nobody has to ask of which kind the equations are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Any

from ..compiler import Kind, Step, kinds_of
from ..errors import CannotMeasure
from ..numbers import Graph, Scope, uncollected
from ..numbers.types import Column, Entries, Letters, SymbolicMatrix
from ..rules import Discretisation
from ..scene import Scene
from .arrows import Arrows
from .on_group import Element
from .symbols import SceneSymbols, column


class StepEquations:
    """One step by a rule, derived from a scene's functions: symbolic, exact, without values.

    Attributes: x, u, y, v, h, columns of the letters in `s`; z = (x, μ), (n+m)×1. unknowns: the
    columns of w with their kinds. rows, which vanish at w, and increment, the growth of z, are
    nodes, or columns of expressions, in z, w, h and the letters of `scope`, which differentiates
    them.
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
    rows: Entries
    increment: Entries
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
        n, rows = len(self.x), [*map(self.graph.node, self.rows)]
        slope = self.scope.jacobian(rows, self.graph.letters(self.w))
        return self._step(
            w=tuple(self.w),
            kinds=kinds_of(*self.unknowns),
            rows=rows,
            slope=[e for row in slope for e in row],
            increment=self.increment[:n],
            gain=self.increment[n:],
            wanted=(0,) * len(rows),
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
