"""The flow of a scene with contact: free steps at full speed, and steps with contact."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from ...compiler import KernelsAtStep, Status
from ...equations import DiscretisedScene
from ...errors import BadInput, StepFailure
from ...flows import CAUSES, FreeMotion, SceneRuns, Start, Substeps
from ...numbers import Number, Numbers, Vector
from ...numbers.types import Given
from ...runs import NotOneMap, Trajectory, run
from .contact_run import ContactRun, Impacts
from .contact_step import Moment
from .gaps import Gaps, gap_expressions
from .located_step import LocatedSteps
from .start import check_gaps

MOST_AT_ONCE = 4096  # largest number of free steps before the next check for a contact


class ContactFlow(NotOneMap, SceneRuns):
    """The flow of a scene with contact: (x, μ) ↦ (x, μ) with φ ≥ 0 (`contact.ContactSteps`).

    It has no maps of arrows, no forms and no past. Raises `BadInput` for a negative step, and for
    an on_edge other than "refuse".
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
        scene = self.scheme.scene
        e = self.numbers.number(scene.restitution)
        stepped = scene.impacts == "stepped"
        return LocatedSteps(self.gaps, self.context.h, self._part, e, stepped)

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
            of = machine
            parts = [[share * part.q[0], *part.q[1:]] for part in self.parts]
            machine = KernelsAtStep(of.kernels, self.numbers, parts, list(of.kinds), of.name)
        guess = self.context.start(x, mu, u)
        start = machine.start_at(x, mu, machine.c, guess)
        arrays = machine.buffers(start, 1, 1, self.edge.begun)
        status = machine.one_step(arrays)
        if status != Status.OK:
            raise self.context.failure(CAUSES[status], {"x": x, "mu": mu})
        leaving = arrays.us[0, : len(mu)]
        if self.context.equations.arrows is None:
            leaving = self.gaps.velocity(x, mu, u)
        return *machine.point(arrays.state), leaving

    def stepper(self, start: Start) -> _Run:
        """Return a run from a start; a closed gap that is closing there begins with an impact."""
        if start is not self.starting.own:
            s = self.scheme.equations.s
            check_gaps(s, self.scheme.scene, self.numbers.public(start.x[: s.n]))
        return _Run(self, start)

    @property
    def why_not_one_map(self) -> str:
        """Why no form is measured on a step."""
        return (
            f"{self.name} has contact: forms, inverse steps and Legendre maps are not "
            "defined if a step contains impulses; use discmech contact."
        )


class _Run(ContactRun):
    """One run of a contact flow."""

    counters = ("index", "ended", "chunk")

    def __init__(self, flow: ContactFlow, start: Start) -> None:
        self.flow, contact, m = flow, flow._steps, len(start.mu)
        self.start, self.chunk, self.name = start, 8, flow.scheme.scene.name
        u = start.guess[:m]
        if flow.context.equations.arrows is None:
            near = flow.context.vector(flow.scheme.scene.v0, m)
            u = flow.gaps.velocity(start.x, start.mu, near)
        place = flow.gaps.at_start(start.x)
        super().__init__(contact, Moment(place, start.mu, u, contact.no_noise()))

    @property
    def key(self) -> str:
        """The key of the free motion, and the gaps."""
        flow = self.flow
        scene, free = flow.scheme.scene, SceneRuns.stepper(flow, self.start)
        assert scene.contact is not None
        gaps = gap_expressions(flow.scheme.equations.s, scene.contact)
        return f"{free.key} {gaps} {scene.friction} {scene.restitution} {scene.impacts}"

    @property
    def state(self) -> dict[str, np.ndarray]:
        return {**super().state, "unsure": np.array(sorted(self.flow.unsure_gaps), np.int64)}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        super().restore(state)
        self.flow.unsure_gaps.update(state["unsure"].tolist())

    def failed(self, failure: Exception, rows: Trajectory) -> StepFailure:
        cause, m = getattr(failure, "cause", str(failure)), self.moment
        state: dict[str, Numbers] = {"x": m.place.x, "mu": m.mu}
        error: StepFailure = self.flow.context.failure(cause, state, self.index, rows)
        return error

    def step(self) -> None:
        """Take free steps, or a step with contact."""
        if not self._take_free_steps():
            super().step()
            self.chunk = 8

    def _take_free_steps(self) -> bool:
        """Take free steps up to the first one with a contact; return True if there were any."""
        m, at = self.moment, self.moment.place.x
        if m.place.closed.any():
            moving = m._replace(u=self.gaps.velocity(at, m.mu, m.u))
            if len(self.contact.resting(moving)):
                return False
        count = min(self.chunk, self.steps - self.index)
        start = Start(at, m.mu, self.flow.context.start(at, m.mu, m.u))
        try:
            free_run = run(FreeMotion(self.flow.edge, start), count)
        except StepFailure as failure:  # perhaps beyond a contact that was not checked for
            free_run = failure.trajectory
            if free_run is None or len(free_run.t) < 2:
                return False
        x, mu, u = map(self.numbers.own, (free_run.base, free_run.mu, free_run.u))
        free, phi = self.flow._steps.free_steps(x)
        for k in range(free):
            self.write(x[k], mu[k], u[k])
            self.index += 1
        if free:
            place = self.gaps.at(x[free], abs(phi[free] - phi[free - 1]))
            self.moment = Moment(place, mu[free], u[free], self.contact.no_noise())
        self.chunk = min(2 * self.chunk, MOST_AT_ONCE)
        return free > 0

    def rows_of(self, count: int) -> Trajectory:
        flow, public, at = self.flow, self.numbers.public, self.numbers
        x, mu, u, impulses = (self.rows[word][:count] for word in ("x", "mu", "u", "impulses"))
        index = np.arange(count, dtype=np.int64) * self.every
        base, n = public(x), self.gaps.n
        phi = public(self.gaps.phi(x)) if count else base[:, :0]
        return Trajectory.of_rows(
            public(at.multiples(flow.step, index) + at.number(self.start.t0)), base[:, :n],
            public(u), public(mu), steps=self.index, step=flow.step, base=base,
            multipliers=public(impulses[:, :, 0] / flow.context.h), scheme=flow.scheme,
            solver="Newton, contacts in cones", impulses=public(impulses), gaps=phi,
            impacts=self._impacts(),
        )  # fmt: skip

    def _impacts(self) -> Impacts:
        numbers, h = self.numbers, self.flow.context.h
        times = [numbers.number(self.flow.step * k) + e.share * h + numbers.number(self.start.t0)
                 for k, e in self.impacts]  # fmt: skip
        n, m = self.gaps.n, self.moment.mu.shape[0]

        def table(values: list[Numbers], *shape: int) -> np.ndarray:
            rows: np.ndarray = numbers.public(numbers.array(values, len(values), *shape))
            return rows

        each = [e for _, e in self.impacts]
        return Impacts(
            table(times), table([e.x[:n] for e in each], n), table([e.before for e in each], m),
            table([e.after for e in each], m),
            table([e.impulses for e in each], *self.gaps.no_impulses.shape),
        )  # fmt: skip
