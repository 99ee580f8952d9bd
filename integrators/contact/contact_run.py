"""A run under contact: its rows, its impacts, and the report of a failure."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from ..errors import CannotMeasure, StepFailure
from ..numbers import finite
from ..numbers.types import Vector
from .contact_step import ContactSteps, Moment


class ContactRun(ABC):
    """A run of `steps` steps from a moment; every `every`-th step writes a row.

    rows: x, μ and u; impulses (r, K, 1 + D) of the step that leaves a row; impacts: (step, impact).
    """

    def __init__(
        self,
        contact: ContactSteps,
        moment: Moment,
        steps: int,
        every: int,
        progress: Callable[[int], None] | None,
    ) -> None:
        self.contact, self.gaps, self.moment = contact, contact.gaps, moment
        self.steps, self.every, self.progress, self.index = steps, every, progress, 0
        count, zeros = steps // every + 1, contact.gaps.numbers.zeros
        self.rows = [zeros(count, len(e)) for e in (moment.place.x, moment.mu, moment.u)]
        self.impulses = zeros(count, *contact.gaps.no_impulses.shape)
        self.impacts: list[tuple[int, Any]] = []

    def trajectory_of_run(self) -> Any:
        """Do the run and return its trajectory; raises `StepFailure` with the rows so far."""
        while self.index < self.steps:
            with self._reporting():
                self.advance()
                self._look()
            if self.progress is not None:
                self.progress(self.index)
        with self._reporting():
            m = self.moment
            self.write(m.place.x, m.mu, self.contact.free.part(1, m.place.x, m.mu, m.u)[2])
        return self.trajectory(self.steps // self.every + 1)

    def _look(self) -> None:
        """Raise `CannotMeasure` if the present x or μ is no longer finite."""
        for name, part in (("x", self.moment.place.x), ("mu", self.moment.mu)):
            if len(lost := np.flatnonzero(~finite(part))):
                self.index -= 1
                where = self.component(name, int(lost[0]))
                raise CannotMeasure(f"the numbers are no longer finite, first {where}")

    def component(self, name: str, k: int) -> str:
        """Return the name of entry k of x or mu."""
        return f"{name}[{k}]"

    def advance(self) -> None:
        """Take one step, or several where that is faster."""
        m = self.moment
        self.moment, u, impulses, impacts = self.contact.step(m)
        self.write(m.place.x, m.mu, u, impulses)
        self.impacts += [(self.index, e) for e in impacts]
        self.index += 1

    def write(self, x: Vector, mu: Vector, u: Vector, impulses: Vector | float = 0) -> None:
        """Write the present row, if this step has one."""
        if self.index % self.every == 0:
            row = self.index // self.every
            for column, value in zip(self.rows, (x, mu, u), strict=True):
                column[row] = value
            self.impulses[row] += impulses

    @contextmanager
    def _reporting(self) -> Iterator[None]:
        try:
            yield
        except (StepFailure, CannotMeasure) as failure:
            cause = failure
        # raised by Python's own functions outside their domain
        except (ArithmeticError, ValueError):
            cause = CannotMeasure("L or a gap has no real value there")
        else:
            return
        raise self.failure(cause, self.trajectory(-(-self.index // self.every))) from None

    @abstractmethod
    def trajectory(self, count: int) -> Any:
        """Return the first `count` rows in the form that a user gets."""

    @abstractmethod
    def failure(self, failure: Exception, rows: Any) -> StepFailure:
        """Return the failure of the coming step; rows: those so far."""
