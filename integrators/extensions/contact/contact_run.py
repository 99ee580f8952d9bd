"""A run under contact as a stepper: its rows, its impacts, and the report of a failure."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import CannotMeasure, StepFailure
from ...numbers import Arithmetic, finite
from ...numbers.types import Matrix, Vector
from ...runs import Allocate, Trajectory, allocated
from .contact_step import ContactSteps, Impact, Moment
from .gaps import Place

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
