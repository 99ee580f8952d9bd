"""Flows of compositions: substeps of one rule, and of its adjoint, under one driver."""

from __future__ import annotations

from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from .compiling import load_composed
from .errors import CannotMeasure
from .flow import Flow

if TYPE_CHECKING:
    from .equations import Scheme


class ComposedFlow(Flow):
    """The one-step map on the dual of a composition; a row's u is that of the first substep.

    A composition has no Ψ on the groupoid's arrows of its own, so `evolve`, `devolve`, `tangent`
    and `pullback_defect` raise `CannotMeasure`; its structure is judged by `poisson_defect`.
    """

    def __init__(self, scheme: Scheme, step: Any, digits: int = 16) -> None:
        super().__init__(scheme, step, digits)
        of_kind = [scheme, *([scheme.adjoint] if any(s.adjoint for s in scheme.substeps) else [])]
        made: dict[tuple[Fraction, bool], Flow] = {}
        self.schemes = of_kind
        self.kinds = np.array([int(s.adjoint) for s in scheme.substeps], dtype=np.int64)
        #: one flow each substep, shared where size and kind are the same
        self.parts: list[Flow] = []
        for substep in scheme.substeps:
            size = _fraction(substep.coefficient(digits + 30)) * self.step
            key = (size, substep.adjoint)
            if key not in made:
                made[key] = Flow(of_kind[substep.adjoint], size, digits)
            self.parts.append(made[key])

    @property
    def first_substep(self) -> Flow:
        """That of the first coefficient's size."""
        return self.parts[0]

    def _legendre_step(self, x: Any, mu: Any, u0: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The substeps' maps one after another, and the product of their derivatives."""
        guess, total = self._guess(u0), None
        for part in self.parts:
            guess = part._arrow_of(x, mu, guess)
            here = part._arrow(x, guess)
            m = part.geometry.dual_step(here, part._h)
            total = m if total is None else m @ total
            x, mu = here["target"], here["plus"] / part._h
        assert total is not None
        return x, mu, total

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
    def _kernels(self) -> dict[str, Any]:
        return load_composed(tuple(s.origin for s in self.schemes), self.numbers)

    @cached_property
    def _c(self) -> Any:
        """One row of coefficients each substep, shorter ones filled up."""
        prepare = [self._kernels["prepare"], self._kernels["prepare_of_adjoint"]]
        rows = [self._prepared(prepare[kind], part._q)
                for kind, part in zip(self.kinds, self.parts, strict=True)]  # fmt: skip
        table = self.numbers.zeros(len(rows), max(map(len, rows)))
        for j, row in enumerate(rows):
            table[j, : len(row)] = row
        return table

    def _lead(self, x: Any, mu: Any, guess: Any) -> tuple[Any, ...]:
        shape, other = self._kernels["SHAPES"]
        n, m = len(x), len(mu)
        state = self.numbers.zeros(2 * (n + m) + shape["carried"] + other["carried"])
        state[:n], state[n : n + m] = x, mu
        if not self.kinds.any():  # else they are computed where a substep follows another kind
            at = 2 * (n + m)
            state[at : at + shape["carried"]] = self._kernels["carry_at_start"](x, self._c[0])
        solved = shape["solved"]
        memory = self.numbers.zeros(len(self.parts), 5 * solved + 4)
        for row in memory:
            self._remember(row, guess, solved)
        return state, memory, self._c, self.kinds

    def _last_solution(self, lead: tuple[Any, ...]) -> dict[str, Any]:
        shape = self._kernels["SHAPES"][0]
        return {} if shape["affine"] else {"u": lead[1][0][: len(self.scheme.u)]}


def _fraction(value: Any) -> Fraction:
    """The exact binary value of an mpf."""
    from .exact import exact_rational

    return exact_rational(value, "coefficient")
