"""The flow of a scene with contact: free steps at full speed, and steps with contact."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..compiler import KernelsAtStep, Status
from ..contact import ContactRun, FreeSteps, Gaps, LocatedSteps, Moment, check_gaps
from ..equations import DiscretisedScene
from ..errors import BadInput, CannotMeasure, StepFailure
from ..numbers import Matrix, Number, Numbers, Vector
from ..numbers.types import Given
from .failures import CAUSES
from .flow import Flow, Substeps
from .initial_state import Start
from .run import Progress, Trajectory, run_from

MOST_AT_ONCE = 4096  # largest number of free steps before the next check for a contact


@dataclass(frozen=True)
class Impacts:
    """The impacts of a run: t (i,), x (i, n), before and after (i, m), impulses (i, K, 1 + D).

    before, after: μ; the jump is Σ impulses over the gaps, the normal one along A = φ′ρ̂, the
    others along the coordinates of the plane of contact.
    """

    t: Vector
    x: Matrix
    before: Matrix
    after: Matrix
    impulses: np.ndarray


@dataclass(frozen=True)
class ContactTrajectory(Trajectory):
    """Rows of a run with contact: those of any run, impulses, gaps and impacts.

    multipliers (r, K): the normal impulse of each gap in the step that leaves a row, divided by h.
    impulses (r, K, 1 + D): that impulse, and those of friction along the coordinates of its plane;
    D = 0 if no gap has friction. gaps (r, K): φ. impacts: all impacts, whether their step has a row
    or not.
    """

    impulses: np.ndarray
    gaps: Matrix
    impacts: Impacts


class ContactFlow(Flow):
    """The flow of a scene with contact: (x, μ) ↦ (x, μ) with φ ≥ 0 (`contact.ContactSteps`).

    It has no maps of arrows, no forms and no past: methods that need them raise `CannotMeasure`.
    Raises `BadInput` for a negative step, and for an on_edge other than "refuse".
    """

    def __init__(
        self, scheme: DiscretisedScene, step: Given, digits: int, on_edge: str,
        substeps: Substeps,
    ) -> None:  # fmt: skip
        super().__init__(scheme, step, digits, on_edge, substeps)
        scene = scheme.scene
        if self.step < 0:
            raise BadInput(
                f"{scene.name}: an impact has no unique past, so a scene with contact takes "
                "positive steps only."
            )
        if on_edge != "refuse":
            raise BadInput(f'{scene.name}: contact needs on_edge="refuse", the default.')

    #: the class that finds the impulses of the contacts
    gaps_kind: type[Gaps] = Gaps

    @cached_property
    def gaps(self) -> Gaps:
        """The gaps as numbers of this flow."""
        return self.gaps_kind(self.scheme.equations.s, self.scheme.scene, self.numbers)

    @cached_property
    def _steps(self) -> LocatedSteps:
        scene, h = self.scheme.scene, self.context.h
        e = self.numbers.number(scene.restitution)
        stepped = scene.impacts == "stepped"
        return LocatedSteps(self.gaps, FreeSteps(h, self._part), e, stepped)

    @property
    def unsure_gaps(self) -> set[int]:
        """The gaps that runs met within a step by less than the round-off of their terms."""
        return self._steps.unsure

    def _part(
        self, share: Number, x: Vector, mu: Vector, u: Vector
    ) -> tuple[Vector, Vector, Vector]:
        """Return (y, μ′, u) after a free step of a share of the step."""
        machine = self.machine
        if share != 1:
            of = self.machine
            parts = [[share * part.q[0], *part.q[1:]] for part in self.parts]
            machine = KernelsAtStep(of.kernels, self.numbers, parts, list(of.kinds), of.name)
        guess = self.context.start(x, mu, u)
        run = machine.buffers(machine.start_at(x, mu, machine.c, guess), 1, 1)
        self.edge.begin(run, None)
        status = machine.one_step(run)
        if status != Status.OK:
            raise self.context.failure(CAUSES[status], {"x": x, "mu": mu})
        leaving = run.us[0, : len(mu)]
        if self.context.equations.arrows is None:
            leaving = self.gaps.velocity(x, mu, u)
        return *machine.point(run.state), leaving

    def _run_from(
        self, start: Start, steps: int, every: int, progress: Progress
    ) -> ContactTrajectory:
        """Run from a start; a closed gap that is closing there begins with an impact."""
        if start is not self.starting.own:
            s = self.scheme.equations.s
            check_gaps(s, self.scheme.scene, self.numbers.public(start.x[: s.n]))
        return _Run(self, start, steps, every, progress).trajectory_of_run()

    def dual_step(self, x: Numbers, mu: Numbers) -> tuple[Vector, Vector]:
        """Return (x, μ) after one step with its contacts."""
        run = self.trajectory(1, x0=x, mu0=mu)
        return run.base[-1], run.mu[-1]

    def _no_form(self, *given: Any, **named: Any) -> Any:
        """Raise `CannotMeasure`: forms are not defined if a step contains impulses."""
        raise CannotMeasure(
            f"{self.scheme.scene.name} has contact: forms, inverse steps and Legendre maps are not "
            "defined if a step contains impulses; use discmech contact."
        )

    poisson_defect = step_defect = tangent = solutions = inverse_legendre = _no_form


class _Run(ContactRun):
    """One run of a contact flow."""

    def __init__(
        self, flow: ContactFlow, start: Start, steps: int, every: int, progress: Progress
    ) -> None:
        self.flow, self.numbers, contact = flow, flow.numbers, flow._steps
        self.t0, self.chunk, m = start.t0, 8, len(start.mu)
        u = start.guess[:m]
        if flow.context.equations.arrows is None:
            near = flow.context.vector(flow.scheme.scene.v0, m)
            u = flow.gaps.velocity(start.x, start.mu, near)
        moment = Moment(flow.gaps.at_start(start.x), start.mu, u, contact.no_noise())
        super().__init__(contact, moment, steps, every, progress)

    def failure(self, failure: Exception, rows: Trajectory | None) -> StepFailure:
        """Return the failure of the coming step."""
        cause, m = getattr(failure, "cause", str(failure)), self.moment
        state: dict[str, Numbers] = {"x": m.place.x, "mu": m.mu}
        found: StepFailure = self.flow.context.failure(cause, state, self.index, rows)
        return found

    def advance(self) -> None:
        """Take free steps, or a step with contact."""
        if not self._take_free_steps():
            super().advance()
            self.chunk = 8

    def _take_free_steps(self) -> bool:
        """Take free steps up to the first one with a contact; return True if there were any."""
        m, numbers = self.moment, self.numbers
        at = m.place.x
        if m.place.closed.any():
            moving = m._replace(u=self.gaps.velocity(at, m.mu, m.u))
            if len(self.contact.resting(moving)):
                return False
        count = min(self.chunk, self.steps - self.index)
        start = Start(at, m.mu, self.flow.context.start(at, m.mu, m.u))
        try:
            run = run_from(self.flow.edge, start, count)
        except StepFailure as failure:  # perhaps beyond a contact that was not checked for
            run = failure.trajectory
            if run is None or len(run.t) < 2:
                return False
        x, mu, u = (
            np.array([[numbers.number(e) for e in row] for row in rows], dtype=numbers.dtype)
            if numbers.dtype is object else rows for rows in (run.base, run.mu, run.u)
        )  # fmt: skip
        free, phi = self.flow._steps.free_steps(x)
        for k in range(free):
            self.write(x[k], mu[k], u[k])
            self.index += 1
        if free:
            place = self.gaps.at(x[free], abs(phi[free] - phi[free - 1]))
            self.moment = Moment(place, mu[free], u[free], self.contact.no_noise())
        self.chunk = min(2 * self.chunk, MOST_AT_ONCE)
        return free > 0

    def trajectory(self, count: int) -> ContactTrajectory:
        """Return the first `count` rows as a trajectory."""
        flow, public = self.flow, self.numbers.public
        x, mu, u = (public(rows[:count]) for rows in self.rows)
        impulses, n = public(self.impulses[:count]), self.gaps.n
        index = np.arange(count, dtype=np.int64) * self.every
        t0 = self.numbers.number(self.t0)
        phi = public(self.gaps.phi(self.rows[0][:count])) if count else x[:, :0]
        zero = np.zeros(count, dtype=np.int64)
        return ContactTrajectory(
            t=public(self.numbers.multiples(flow.step, index) + t0), x=x[:, :n], u=u, mu=mu,
            iterations=zero, newton_mean=0.0, newton_max=0, newton_residual=0.0,
            steps=self.index, step=flow.step, margin=1.0, edges=0, translates=zero, base=x,
            multipliers=public(self.impulses[:count, :, 0] / flow.context.h),
            solver="Newton, contacts in cones", contraction=0.0, impulses=impulses, gaps=phi,
            impacts=self._impacts(), scheme=flow.scheme,
        )  # fmt: skip

    def _impacts(self) -> Impacts:
        numbers, h = self.numbers, self.flow.context.h
        times = [numbers.number(self.flow.step * k) + e.share * h + numbers.number(self.t0)
                 for k, e in self.impacts]  # fmt: skip
        n, m = self.gaps.n, self.rows[1].shape[1]

        def table(values: list[Numbers], *shape: int) -> np.ndarray:
            found: np.ndarray = numbers.public(numbers.array(values, len(values), *shape))
            return found

        each = [e for _, e in self.impacts]
        return Impacts(
            table(times), table([e.x[:n] for e in each], n), table([e.before for e in each], m),
            table([e.after for e in each], m),
            table([e.impulses for e in each], *self.impulses.shape[1:]),
        )  # fmt: skip
