"""A scheme at one step size and one precision: steps, trajectories and defects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from ..bisections import POLICIES, Bisect, EdgePolicy, Solution
from ..compiler import Kernels, KernelsAtStep, StagesAtStep, Step, compile
from ..equations import DiscretisedScene, blamed, composed_step
from ..errors import BadInput, arguments_checked, check_progress, shown
from ..geometry import Arrow, LocalGeometry, Maps, StepContext
from ..hooks import run_differentiated
from ..numbers import Matrix, Number, Numbers, Vector, arithmetic, exact_rational, whole_number
from ..numbers.types import Given, Rows
from ..runs import File, Progress, RunDerivatives, RunGradient, Stepper, Trajectory, run
from ..scene import Again, flow_of
from .collocation import collocation
from .ensemble import Ensemble, ensemble
from .free_motion import FreeMotion, element_of, first_u
from .initial_state import Start, Starting
from .newton_step import arrow_before, of_poisson, of_pullback, of_step
from .step_choice import StepChoice

INTEGER = (int, np.integer)
# the squares and inverses of such steps are far from over- and underflow
TINIEST = Fraction(1, 10**100)

#: (the scheme of a substep, a function digits ↦ its share of the step)
Substeps = Sequence[tuple[DiscretisedScene, Callable[[int], Number]]]


class Flow:
    """The one-step maps of a scheme: (x, μ) ↦ (b, μ′) on the dual, Ψ: (x, u) ↦ (y, v) on G.

    step: a non-zero number (exact: a float is its binary value; "0.1" is one tenth); a negative
    step runs Φ₋ₕ, which is the inverse only for a self-adjoint rule. digits = 16 is compiled double
    precision, more gives mpmath numbers, and 7 single precision, run by Python.

    on_edge: "refuse", "bisect" or "shrink" if a step reaches the edge of its chart
    (`bisections.edge_policies`). substeps: those of a composition, whose rows
    have the u of the first substep; it has no Ψ on arrows, so its `evolve`, `devolve`, `tangent`
    and `pullback_defect` raise `CannotMeasure`. Raises `BadInput` for a step that is 0 or not
    finite, and for another on_edge.
    """

    #: savings that the kernels do not make (`omissions.SAVINGS`), so that their gain can be
    #: measured
    without: frozenset[str] = frozenset()
    #: how the step was chosen, if a tolerance was given (`Scheme.flow`)
    choice: StepChoice | None = None

    def __init__(
        self,
        scheme: DiscretisedScene,
        step: Given,
        digits: int = 16,
        on_edge: str = "refuse",
        substeps: Substeps = (),
    ) -> None:
        self.scheme, self.digits, self.on_edge = scheme, digits, on_edge
        self.step = size = exact_rational(step, "step")
        if on_edge not in POLICIES:
            choices = ", ".join(map(repr, POLICIES))
            raise BadInput(f"on_edge is {shown(on_edge)}: give one of {choices}.")
        if size == 0:
            raise BadInput("a step of 0 goes nowhere: give a positive or negative step.")
        if not TINIEST <= abs(size) <= 1 / TINIEST:
            raise BadInput("the step is beyond 1e-100 or 1e100: choose units that fit the motion.")
        self.numbers = numbers = arithmetic(digits, single=True)
        # thirty more digits, so that the shares add up to 1 in the flow's own numbers
        shares = [(e, exact_rational(share(digits + 30), "coefficient")) for e, share in substeps]
        made = {key: StepContext(key[0], numbers, key[1] * size) for key in shares}
        self.context = StepContext(scheme, numbers, size, tuple(made[key] for key in shares))
        #: contexts whose steps, one after another, make a step of this flow
        self.parts = self.context.parts

    def __reduce__(self) -> Again:
        """Return the pickled form: the flow is made again from its scheme, step and digits."""
        own = {k: v for k, v in vars(self).items() if k in ("choice", "without")}
        return flow_of, (self.scheme, self.step, self.digits, self.on_edge, own)

    @arguments_checked
    def trajectory(
        self,
        steps: int,
        every: int = 1,
        *,
        x0: Numbers | None = None,
        mu0: Numbers | None = None,
        u0: Numbers | None = None,
        element0: Rows | None = None,
        t0: Given = 0,
        checkpoint: File = None,
        progress: Progress = None,
    ) -> Trajectory:
        """Run `steps` steps from the scene's start (or from x0, mu0), with a row every `every`
        steps.

        t0: the time of the start (exact), which matters if the scene depends on time; an x0 with
        its time, such as a row of `Trajectory.base`, needs no t0. Memory grows with the rows, not
        with the steps. u0 is only Newton's first guess. If L_d is given on the group, element0
        (N×N) may be the first step g instead: μ0 = F⁻/h. `progress` is called with the number of
        steps done so far. checkpoint: a file. The rows are then kept beside it, and the state is
        saved in it about once a second: the same call continues a killed run, with the same
        numbers. Raises `StepFailure` (with the rows so far) if a step cannot be solved, `BadInput`
        for wrong shapes and counts, starts off a constraint, and the checkpoint of another run.
        """
        steps, every = whole_number("steps", steps, 0), whole_number("every", every, 1)
        check_progress(progress)
        with self.numbers.working():
            t0 = t0 if type(t0) is int else exact_rational(t0, "t0")
            start = self.starting.at(x0, mu0, u0, element0, t0)
            if mu0 is not None:
                self.starting.check(start)
            return run(self.stepper(start), steps, every, progress, checkpoint)

    def stepper(self, start: Start) -> Stepper:
        """Return a run from a start, for the loop `runs.run`."""
        return FreeMotion(self.edge, start)

    def ensemble(
        self,
        x0s: Rows | None = None,
        mu0s: Rows | None = None,
        steps: Any = None,
        every: int = 1,
        **given: Any,
    ) -> Ensemble:
        """Run from many starts at once, on all cores; rows as in `trajectory`, members along axis
        0.

        x0s (k, n) and mu0s (k, m); None takes the scene's own for all. steps must be given. given:
        arguments of `trajectory`, for all members; each member has a checkpoint of its own, FILE.0
        and so on. A member that fails does not stop the others (`Ensemble.failures`). Raises
        `BadInput` for starts that do not fit.
        """

        def member(index: int, x0: Numbers | None, mu0: Numbers | None) -> Trajectory:
            own = dict(given)
            if own.get("checkpoint") is not None:
                own["checkpoint"] = f"{own['checkpoint']}.{index}"
            return self.trajectory(steps, every, x0=x0, mu0=mu0, **own)

        return ensemble(member, x0s, mu0s, self.numbers, self.scheme.scene.name)

    def elements(self, run: Trajectory) -> np.ndarray:
        """Return the group elements g = τ(hu) B of a run's rows, (r, N, N); in Cayley's chart only.

        Raises `BadInput` for other charts and for a run of another flow.
        """
        self._check_own(run)
        with self.numbers.working():
            rows = [element_of(self.context, run, row) for row in range(len(run.u))]
            return self.numbers.public(np.array(rows))

    def arrow(self, run: Trajectory, row: int) -> Arrow:
        """Return the arrow of a run's row, for `geometry.transitions`; raises like `elements`."""
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

    def dual_step(self, x: Numbers, mu: Numbers) -> tuple[Vector, Vector]:
        """Return (b, μ′), the step from (x, μ) on the dual algebroid, with u from F⁻(x, u) = hμ.

        With contact the step has its impulses in it; a step that varies begins with the density
        1/σ, and with E₀ the energy.
        """
        with self.numbers.working():
            rows = run(self.stepper(self.starting.at(x, mu)), 1)
            return rows.base[-1], rows.mu[-1]

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
        constraints it is the defect of ω on the states that they leave (`restricted_form`); raises
        `CannotMeasure` where constraints leave none, and there for compositions.
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

    @property
    def geometry(self) -> LocalGeometry:
        """The scheme's maps and derivatives as numbers at this step."""
        return self.context.geometry

    @cached_property
    def system(self) -> Step:
        """One step as data to be compiled; for a composition with its adjoint's substeps."""
        if not self.context.substeps:
            return self.context.equations.step
        return composed_step(*dict.fromkeys(c.equations for c in (self.context, *self.parts)))

    @cached_property
    def _kernels(self) -> Kernels:
        with blamed(self.scheme):
            return compile(self.system, self.numbers, self.without)

    @cached_property
    def machine(self) -> KernelsAtStep:
        """The compiled kernels at this step, with their coefficients and buffers."""
        name = f"{self.scheme.scene.name} with {self.scheme.rule.name}"
        kinds = [int(part.equations is not self.context.equations) for part in self.parts]
        return KernelsAtStep(self._kernels, self.numbers, [p.q for p in self.parts], kinds, name)

    @cached_property
    def edge(self) -> EdgePolicy:
        """The policy for steps that reach the edge of their chart."""
        made = (lambda: self.machine), (lambda: self.system)
        return POLICIES[self.on_edge](self.context, *made, self.stages)

    @cached_property
    def stages(self) -> StagesAtStep | None:
        """The kernels of collocation at this step, or None if Newton's method solves all steps."""
        return self._collocation[0]

    @property
    def by_newton(self) -> str:
        """The reason for steps by Newton's method alone; "" if a fixed point goes first."""
        return self._collocation[1]

    @cached_property
    def _collocation(self) -> tuple[StagesAtStep | None, str]:
        return collocation(self.context, self.without)

    @cached_property
    def starting(self) -> Starting:
        """The starts of runs."""
        return Starting(self.edge)
