"""Flows of compositions: substeps of one rule, and of its adjoint, under one driver."""

from __future__ import annotations

from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from .compiling import load_composed
from .errors import CannotMeasure
from .flow import Flow
from .tangent import newton, relative_defect

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

    def poisson_defect(self, x: Any, mu: Any, *, u0: Any = None, bracket_sign: int = 1) -> Any:
        """As `Flow.poisson_defect`, M being the product of the substeps' derivatives."""
        with self.numbers.working():
            x, mu = self._vectors(x, mu)
            guess = self._guess if u0 is None else self._vectors(x, u0)[1]
            first, total = self.parts[0].geometry, None
            before = first.poisson_tensor(x, mu, bracket_sign)
            for part in self.parts:
                guess = self._arrow_of(part, x, mu, guess)
                here = part._arrow(x, guess)
                m = part.geometry.dual_step(here, part._h)
                total = m if total is None else m @ total
                x, mu = here["target"], here["plus"] / part._h
            after = first.poisson_tensor(x, mu, bracket_sign)
            assert total is not None
            return self._number(relative_defect(total @ before @ total.T, after, total))

    def _arrow_of(self, part: Flow, x: Any, mu: Any, guess: Any) -> np.ndarray:
        """The u with F⁻(x, u) = hμ of one substep, by Newton from the guess."""

        def change(u: np.ndarray) -> np.ndarray:
            here = part.geometry.at(x, u)
            return np.asarray(self.numbers.solve(here["minus_u"], part._h * mu - here["minus"]))

        found = newton(change, guess, 0, self.numbers.eps)
        if found is None:
            where = {"x": self.numbers.public(x), "mu": self.numbers.public(mu)}
            raise self._failure(0, where, "a substep was not found", None)
        return found

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

    @property
    def _guess(self) -> np.ndarray:
        return self._vectors(self.scheme.scene.x0, self.scheme.scene.v0)[1]

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
