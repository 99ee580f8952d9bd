"""Flows of compositions: substeps of one rule, and of its adjoint, under one driver."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any, NoReturn

from ..compiler import System
from ..equations.discrete_equations import DiscreteEquations
from ..equations.step_system import step_system
from ..errors import CannotMeasure
from ..rules.composition import Substep
from .flow import Flow


class ComposedFlow(Flow):
    """The one-step map on the dual of a composition; a row's u is that of the first substep.

    schemes: of the composed rule, and of its adjoint if a substep is one of that.

    A composition has no Ψ on the groupoid's arrows of its own, so `evolve`, `devolve`, `tangent`
    and `pullback_defect` raise `CannotMeasure`; its structure is judged by `poisson_defect`.
    """

    def __init__(
        self,
        schemes: Sequence[DiscreteEquations],
        substeps: Sequence[Substep],
        step: Any,
        digits: int = 16,
        on_edge: str = "refuse",
    ) -> None:
        super().__init__(schemes[0], step, digits, on_edge)
        made: dict[tuple[Fraction, bool], Flow] = {}
        self.schemes = schemes
        self.kinds = [int(s.adjoint) for s in substeps]
        #: one flow each substep, shared where size and kind are the same
        self.parts = []
        for substep in substeps:
            size = _fraction(substep.coefficient(digits + 30)) * self.step
            key = (size, substep.adjoint)
            if key not in made:
                made[key] = Flow(schemes[substep.adjoint], size, digits)
            self.parts.append(made[key])

    def evolve(self, x: Any, u: Any) -> NoReturn:
        """Not defined for compositions: raises `CannotMeasure`."""
        raise self._no_arrows()

    def devolve(self, y: Any, v: Any) -> NoReturn:
        """Not defined for compositions: raises `CannotMeasure`."""
        raise self._no_arrows()

    def tangent(self, x: Any, u: Any) -> NoReturn:
        """Not defined for compositions: raises `CannotMeasure`."""
        raise self._no_arrows()

    def pullback_defect(self, x: Any, u: Any) -> NoReturn:
        """Not defined for compositions: raises `CannotMeasure`."""
        raise self._no_arrows()

    def _no_arrows(self) -> CannotMeasure:
        return CannotMeasure(
            f"{self.scheme.rule.name} is a composition: it steps on (x, mu), not on arrows (x, u); "
            "use dual_step and poisson_defect."
        )

    # -- inner ----------------------------------------------------------------------------------

    @cached_property
    def _system(self) -> System:
        return step_system(*(s.origin for s in self.schemes), composed=True)


def _fraction(value: Any) -> Fraction:
    """The exact binary value of an mpf."""
    from ..numbers.exact import exact_rational

    return exact_rational(value, "coefficient")
