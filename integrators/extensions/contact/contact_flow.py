"""The flow of a scene with contact: free steps at full speed, and steps with contact."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...compiler import KernelsAtStep, Status
from ...equations import DiscretisedScene
from ...errors import CannotMeasure, StepFailure
from ...flows import CAUSES, FreeMotion, SceneRuns, Start, Substeps
from ...numbers import Arithmetic, Number, Numbers, finite
from ...numbers.types import Given, Matrix, Vector
from ...runs import Allocate, NotOneMap, Trajectory, allocated, run
from .contact_step import ContactSteps, Impact, Moment
from .gaps import Gaps, Place, gap_expressions
from .located_step import LocatedSteps
from .start import check_gaps

FAILED = 1  # status of a step that was not made


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


class ContactRun(ABC):
    """A run from a moment (`runs.Stepper`).

    rows: x, mu and u; impulses (r, K, 1 + D) of the step that leaves a row; impacts: (step, what
    `recorded` makes of an impact).
    """

    name: str
    #: a tuple with the parts of a recorded impact by name
    kind: Any = Impact
    #: names of the whole numbers that belong to the state
    counters: tuple[str, ...] = ("index", "ended")

    def __init__(self, contact: ContactSteps, moment: Moment) -> None:
        self.contact, self.gaps, self.moment = contact, contact.gaps, moment
        self.numbers: Arithmetic = contact.gaps.numbers
        self.impacts: list[tuple[int, Any]] = []
        self.index, self.ended = 0, False

    def begin(self, steps: int, every: int, allocate: Allocate | None) -> None:
        self.steps, self.every = steps, every
        m, kind = self.moment, self.numbers.dtype
        shapes = {"x": m.place.x.shape, "mu": m.mu.shape, "u": m.u.shape,
                  "impulses": self.gaps.no_impulses.shape}  # fmt: skip
        columns, count = {word: (shape, kind) for word, shape in shapes.items()}, steps // every + 1
        if allocate is None:
            self.rows = allocated(columns, count, self.numbers)
        else:
            self.rows = allocate(columns, count)

    @property
    def whole(self) -> int:
        """The number of complete rows."""
        return self.steps // self.every + 1 if self.ended else -(-self.index // self.every)

    def advance(self) -> int:
        """Take one step, or several where that is faster; the last row needs the u that leaves."""
        try:
            if self.index < self.steps:
                self.step()
                self._look()
            if self.index == self.steps:
                m = self.moment
                self.write(m.place.x, m.mu, self.contact.part(1, m.place.x, m.mu, m.u)[2])
                self.ended = True
        except (StepFailure, CannotMeasure) as failure:
            self.cause: Exception = failure
            return FAILED
        # raised by Python's own functions outside their domain
        except (ArithmeticError, ValueError):
            self.cause = CannotMeasure("L or a gap has no real value there")
            return FAILED
        return 0

    def _look(self) -> None:
        """Raise `CannotMeasure` if the present x, μ or gaps are no longer finite.

        A gap without a value is neither open nor closed: the body would go through the obstacle.
        """
        for name, part in (("x", self.moment.place.x), ("mu", self.moment.mu)):
            if len(lost := np.flatnonzero(~finite(part))):
                self.index -= 1
                where = self.component(name, int(lost[0]))
                raise CannotMeasure(f"the numbers are no longer finite, first {where}")
        if not finite(self.moment.place.phi).all():
            self.index -= 1
            raise CannotMeasure("a gap has no real value there")

    def component(self, name: str, k: int) -> str:
        """Return the name of entry k of x or mu."""
        return f"{name}[{k}]"

    def step(self) -> None:
        """Take one step."""
        m = self.moment
        self.moment, u, impulses, impacts = self.contact.step(m)
        self.write(m.place.x, m.mu, u, impulses)
        for impact in impacts:
            at = m.place if impact.share == 0 else self.moment.place
            self.impacts += [(self.index, e) for e in self.recorded(impact, at)]
        self.index += 1

    def recorded(self, impact: Impact, place: Place) -> list[Any]:
        """Return what is kept of an impact that happened at a place, tuples of `kind`."""
        return [impact]

    def write(self, x: Vector, mu: Vector, u: Vector, impulses: Vector | float = 0) -> None:
        """Write the present row, if this step has one."""
        if self.index % self.every == 0:
            row = self.index // self.every
            for word, value in (("x", x), ("mu", mu), ("u", u)):
                self.rows[word][row] = value
            self.rows["impulses"][row] = self.gaps.no_impulses + impulses

    @property
    def state(self) -> dict[str, np.ndarray]:
        """The moment, as far as its place does not follow from x, and the impacts so far."""
        m = self.moment
        parts = zip(*(e for _, e in self.impacts), strict=True)
        impacts = {f"impact {word}": np.array(values)
                   for word, values in zip(self.kind._fields, parts, strict=False)}  # fmt: skip
        return {
            "x": m.place.x, "mu": m.mu, "u": m.u, "noise": m.noise, "size": m.place.size,
            "closed": m.place.closed, "impact": np.array([k for k, _ in self.impacts], np.int64),
            "at": np.array([getattr(self, word) for word in self.counters], np.int64), **impacts,
        }  # fmt: skip

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        place = self.gaps.at(state["x"])._replace(size=state["size"], closed=state["closed"])
        self.moment = Moment(place, *(state[word] for word in ("mu", "u", "noise")))
        for word, value in zip(self.counters, state["at"].tolist(), strict=True):
            setattr(self, word, value)
        steps = state["impact"].tolist()
        parts = [state[f"impact {word}"] for word in self.kind._fields] if steps else []
        self.impacts = [(k, self.kind(*e)) for k, *e in zip(steps, *parts, strict=True)]

    def failure(self, status: int) -> StepFailure:
        return self.failed(self.cause, self.rows_of(-(-self.index // self.every)))

    def trajectory(self) -> Trajectory:
        return self.rows_of(self.whole)

    @property
    @abstractmethod
    def key(self) -> str:
        """A text that tells this run from every other one."""

    @abstractmethod
    def rows_of(self, count: int) -> Trajectory:
        """Return the first `count` rows in the form that a user gets."""

    @abstractmethod
    def failed(self, failure: Exception, rows: Trajectory) -> StepFailure:
        """Return the failure of the coming step; rows: those so far."""


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
        asked = {"a step back": self.step < 0, "edges of charts": on_edge != "refuse"}
        scheme.scene.check_features(*(what for what, wanted in asked.items() if wanted))

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
