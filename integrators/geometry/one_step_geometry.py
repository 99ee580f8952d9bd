"""A one-step map in numbers: its step from a state with the derivative, and starts for Newton."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from functools import cached_property, lru_cache
from typing import Any, NoReturn

import numpy as np

from ..equations import SceneSymbols, legendre_inverse, rates
from ..numbers import (
    Arithmetic,
    Tracked,
    inverse_sizes,
    newton,
    numeric,
    rounded,
    solve,
    tracked_later,
)
from ..numbers.types import Function, Matrix, Number, Numbers, Vector
from .local_geometry import KEPT, LocalGeometry, StagesNotFound


class StepNotFound(StagesNotFound):
    """Newton did not find the step from a state."""


class OneStepGeometry(LocalGeometry):
    """A map's step and its derivative as numbers at a state, in one arithmetic."""

    equations: Any

    @property
    def parameters(self) -> list[Number]:
        """The values of the scene's parameters."""
        return self.q[1 : 1 + len(self.equations.s.parameter_list)]

    def velocities(self, x: Matrix, mu: Matrix, near: Matrix) -> Matrix:
        """Return ξ(x, μ) of rows, (r, m), from velocities nearby; NaN if there is none."""
        inverse = legendre_inverse(self.equations.s, self.numbers)
        return inverse(x, mu, self.parameters, near)

    def start(self, x: Vector, mu: Vector, near: Vector) -> Vector:
        """Return Newton's start from a state: f(z) for each slope, ξ(z) for each velocity.

        It is 0 for impulses, and for an explicit map, whose slope needs no start.
        """
        equations = self.equations
        if equations.explicit:
            return self.numbers.zeros(len(equations.w))
        xi = self.velocities(x[None], mu[None], near[None])[0]
        found = {"velocity": xi}
        if equations.free is None:
            f = _rates(equations.s, self.numbers)(x, xi, mu, self.parameters)
            found |= {"slope": f[: len(equations.state)], "place": x / self.q[0]}
        parts = ((found.get(kind), len(letters)) for kind, letters in equations.unknowns)
        return np.concatenate([self.numbers.zeros(k) if e is None else e for e, k in parts])

    def step(self, x: Vector, mu: Vector, start: Vector) -> tuple[Vector, Vector, Tracked]:
        """Return (x′, μ′) and the derivative of (x, μ) ↦ (x′, μ′), (n+m)×(n+m), by Newton from a
        start.

        The derivative is exact, from the implicit function theorem, and `Tracked`. Raises
        `StepNotFound` if Newton diverges.
        """
        still = self.numbers.zeros(self.n + self.m)
        _, (_, slope, rows_z, grown, by_w, by_z) = self._solved(x, mu, start, still)
        one = self.numbers.identity(self.n + self.m)
        derivative = one + by_z - by_w @ solve(self.numbers, slope, rows_z)
        return x + grown.value[: self.n], mu + grown.value[self.n :], derivative

    def growth(self, x: Vector, mu: Vector, start: Vector) -> Tracked:
        """Return (x′ − x, μ′ − μ) of the step from a state, `Tracked`, by Newton from a start."""
        return self._solved(x, mu, start, self.numbers.zeros(self.n + self.m))[1][3]

    def step_round_off(self, x: Vector, mu: Vector, start: Vector, errors: Vector) -> Vector:
        """Return the effect of round-off on (x′, μ′), n+m units ε (`defects.step_round_off`)."""
        grown = self._solved(x, mu, start, errors)[1][3]
        before = abs(np.concatenate([x, mu]))
        after = abs(np.concatenate([x, mu]) + grown.value)
        return errors + before + grown.error + after

    def solved(self, x: Vector, mu: Vector, start: Vector) -> tuple[Vector, list[np.ndarray]]:
        """Return (w, results of `one_step`) at the unknowns that solve the rows from (x, μ)."""
        w, found = self._solved(x, mu, start, self.numbers.zeros(self.n + self.m))
        return w, [e.value for e in found]

    def _solved(
        self, x: Vector, mu: Vector, start: Vector, errors: Vector
    ) -> tuple[Vector, list[Tracked]]:
        """Return (w, results of `one_step`) at the unknowns that solve its rows, for errors of (x,
        μ).

        The results for the latest states are remembered, because several forms are measured on one
        step.
        """
        state = tuple(tuple(part) for part in (x, mu, start, errors))
        if state not in self._steps:
            if len(self._steps) >= KEPT:
                del self._steps[next(iter(self._steps))]
            self._steps[state] = self._found(x, mu, start, errors)
        return self._steps[state]

    @cached_property
    def _steps(self) -> dict[Hashable, tuple[Vector, list[Tracked]]]:
        return {}

    def _found(
        self, x: Vector, mu: Vector, start: Vector, errors: Vector
    ) -> tuple[Vector, list[Tracked]]:
        at, momentum = rounded(x, errors[: self.n]), rounded(mu, errors[self.n :])

        def parts(w: Vector) -> Sequence[np.ndarray]:
            return self._value("one_step", x, mu, w, self.q)

        def change(w: Vector) -> Vector:
            rows, slope, *_ = parts(w)
            return -self.numbers.solve(slope, rows)

        def round_off(w: Vector) -> Vector:
            rows = self._errors("one_step")(at, momentum, rounded(w), self._q)[0]
            return abs(w) + inverse_sizes(parts(w)[1]) @ rows.error

        w = newton(change, start, round_off(start), self.numbers.eps)
        if w is None:
            raise StepNotFound("Newton did not find a step again that a run has taken.")

        def with_errors() -> Iterable[Tracked]:
            return self._errors("one_step")(at, momentum, rounded(w, round_off(w)), self._q)

        return w, tracked_later(parts(w), with_errors)

    def at(self, x: Numbers, u: Numbers) -> NoReturn:
        """Raise `CannotMeasure`: a map has no Legendre maps at arrows."""
        raise self.equations.refused("legendre_minus")


@lru_cache(maxsize=256)
def _rates(s: SceneSymbols, numbers: Arithmetic) -> Function:
    letters = {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}
    return numeric(letters, [list(rates(s))], numbers)
