"""A scheme at one step size and one precision: its runs, and what is measured on its steps."""

from __future__ import annotations

import numpy as np

from ..bisections import Bisect, Solution
from ..errors import BadInput, arguments_checked, shown
from ..geometry import Arrow, Maps
from ..hooks import run_differentiated
from ..numbers import Matrix, Number, Numbers, Vector
from ..numbers.types import Rows
from ..runs import RunDerivatives, RunGradient, Trajectory
from .free_motion import element_of, first_u
from .initial_state import Start
from .newton_step import arrow_before, of_poisson, of_pullback, of_step
from .scene_runs import SceneRuns

INTEGER = (int, np.integer)


class Flow(SceneRuns):
    """The one-step maps of a scheme: (x, μ) ↦ (b, μ′) on the dual, Ψ: (x, u) ↦ (y, v) on G.

    A composition and a one-step map have no Ψ on arrows, so their `evolve`, `devolve`, `tangent`
    and `pullback_defect` raise `CannotMeasure`.
    """

    def elements(self, run: Trajectory) -> np.ndarray:
        """Return the group elements g = τ(hu) B of a run's rows, (r, N, N); in Cayley's chart only.

        Raises `BadInput` for other charts and for a run of another flow.
        """
        self._check_own(run)
        with self.numbers.working():
            rows = [element_of(self.context, run, row) for row in range(len(run.u))]
            return self.numbers.public(np.array(rows))

    def arrow(self, run: Trajectory, row: int) -> Arrow:
        """Return the arrow of a run's row, for `geometry.residual`; raises like `elements`."""
        self._check_own(run)
        if (
            not isinstance(row, INTEGER)
            or isinstance(row, bool)
            or not -len(run.u) <= row < len(run.u)
        ):
            raise BadInput(f"row is {shown(row)}: the run has the rows 0 to {len(run.u) - 1}.")
        return self.context.arrow(run.x[row], run.mu[row], run.u[row], int(run.translates[row]))

    def _check_own(self, run: Trajectory) -> None:
        if not isinstance(run, Trajectory):
            raise BadInput(f"{shown(run)} is not a run: give the result of a flow's trajectory().")
        made_by = run.scheme or self.scheme  # a run that was pickled has none
        own, other = (
            (e.rule.name, e.scene.name, e.scene.parameter_values) for e in (self.scheme, made_by)
        )
        if run.step != self.step or run.u.shape[1:] != (len(self.scheme.u),) or own != other:
            raise BadInput(
                f"{self.scheme.scene.name}: that run is of another flow; ask the flow that made it."
            )

    @arguments_checked
    def derivatives(self, run: Trajectory, *, held: str = "mu0") -> RunDerivatives:
        """Return the derivatives of a run's rows by its start and by the scene's parameters.

        They are exact for the steps that the run took (`expansions.RunDifferentiated`). held: "mu0"
        or "v0", which of them stays when x₀ and the parameters change. Raises `BadInput` for a run
        of another flow, `CannotMeasure` under constraints and with contact.
        """
        self._check_own(run)
        made: RunDerivatives = run_differentiated(self, run, held).tangent()
        return made

    @arguments_checked
    def gradient(self, run: Trajectory, slope: Numbers | Rows, *, held: str = "mu0") -> RunGradient:
        """Return the gradient of a function of a run's rows by its start and by parameters.

        slope: the function's own gradient by z = (x, μ) of the last row, (N,), or of each row,
        (rows, N). It is the adjoint of `derivatives`, for the price of one of its columns, and
        raises as that does.
        """
        self._check_own(run)
        made: RunGradient = run_differentiated(self, run, held).adjoint(slope)
        return made

    def evolve(self, x: Numbers, u: Numbers) -> tuple[Vector, Vector]:
        """Apply Ψ: return (y, v) with y = b(x, u) and F⁻(y, v) = F⁺(x, u) (paper, section 2.4)."""
        with self.numbers.working():
            x, u = self.context.vectors(x, u)
            y, v = self.next_arrow(self._one_arrow(x, u), x, u)
            return self.numbers.public(y), self.numbers.public(v)

    def next_arrow(
        self, here: Maps, x: Vector, u: Vector, v0: Vector | None = None
    ) -> tuple[Vector, Vector]:
        """Return Ψ(x, u) from the maps there, in the flow's numbers; v0: Newton's start, or u."""
        y, near = here["target"], u if v0 is None else v0
        branch = self.geometry.branch(x, u)
        return y, first_u(self.edge, Start(y, here["plus"] / self.context.h, near), branch)

    def devolve(self, y: Numbers, v: Numbers) -> tuple[Vector, Vector]:
        """Apply Ψ⁻¹: return (x, u) with b(x, u) = y and F⁺(x, u) = F⁻(y, v), by Newton in (x, u).

        Raises `StepFailure` if Newton does not converge.
        """
        self.context.check_one_arrow()
        with self.numbers.working():
            x, u = arrow_before(self.context, *self.context.vectors(y, v))
            return self.numbers.public(x), self.numbers.public(u)

    def inverse_legendre(self, x: Numbers, mu: Numbers) -> Vector:
        """Return u with F⁻(x, u) = hμ; of several solutions the one that Newton reaches from v0."""
        with self.numbers.working():
            return self.numbers.public(first_u(self.edge, self.starting.at(x, mu)))

    def solutions(self, x: Numbers, mu: Numbers) -> list[Solution]:
        """Return the elements g with F⁻(x, g) = hμ, by Newton from the cover's elements (section
        4.3).

        Raises `BadInput` unless on_edge is "bisect".
        """
        if not isinstance(self.edge, Bisect):
            raise BadInput('solutions are searched through a cover: take on_edge="bisect".')
        with self.numbers.working():
            public = self.numbers.public
            return [
                Solution(s.translate, public(s.u), public(s.element), self.context.number(s.branch))
                for s in self.edge.solutions(*self.context.vectors(x, mu))
            ]

    def pullback_defect(self, x: Numbers, u: Numbers, *, v0: Numbers | None = None) -> Number:
        """Return the `entrywise_defect` of PΨᵀ Ω PΨ = Ω at (x, u), in twice the digits.

        v0: a velocity near that of the next arrow.
        """
        with self.numbers.working():
            at, start = self.context.vectors(x, u), self.context.vectors(x, u if v0 is None else v0)
            _, near = self.next_arrow(self._one_arrow(*at), *at, start[1])
        return of_pullback(self.context, *at, near)

    def poisson_defect(
        self, x: Numbers, mu: Numbers, *, u0: Numbers | None = None, bracket_sign: int = 1
    ) -> Number:
        """Return how far the dual step is from M Π Mᵀ = Π′ at (x, μ), where M is its derivative.

        It is an `entrywise_defect`, to twice the digits. u0: Newton's start, by default v0; near a
        chart's edge a run's own u is needed. bracket_sign = −1 flips the bracket of Π, a negative
        control that shows an effect if there are both a base and a group. Under holonomic
        constraints it is the defect of ω on the states that they leave (`restricted_defect`);
        raises `CannotMeasure` where constraints leave none, and there for compositions.
        """
        return of_poisson(self.context, x, mu, u0, bracket_sign)

    def step_defect(
        self,
        x: Numbers,
        mu: Numbers,
        after_x: Numbers,
        after_mu: Numbers,
        *,
        u0: Numbers | None = None,
    ) -> Number:
        """Return how far a step (x, μ) ↦ (after_x, after_mu) is from the discrete equations.

        It is the largest gap of an entry divided by the effect of round-off on it
        (`step_round_off`), times the unit of round-off: at most ε for a correct step. The reference
        is the step of the Legendre maps themselves, to twice the digits, without any kernel.
        """
        return of_step(self.context, (x, mu), (after_x, after_mu), u0)

    def tangent(self, x: Numbers, u: Numbers) -> Matrix:
        """Return TΨ at (x, u), (n+m)×(n+m)."""
        with self.numbers.working():
            x, u = self.context.vectors(x, u)
            here = self._one_arrow(x, u)
            there = self.context.maps_at(*self.next_arrow(here, x, u))
            return self.numbers.public(self.geometry.tangent(here, there))

    def _one_arrow(self, x: Vector, u: Vector) -> Maps:
        self.context.check_one_arrow()
        return self.context.maps_at(x, u)
