"""A run of a black box: its steps in its own coordinates, its rows in those of the scene."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from ...errors import BadInput, StepFailure
from ...numbers import Vector
from ...numbers.types import Exact
from ...runs import Allocate, Trajectory, allocated
from ...scene import Opaque, reads
from .calls import BoxRaised

#: a `BoxFlow`, whose file comes after this one
BoxFlow: TypeAlias = Any

CHUNK = 2**12  # steps between two reports of progress
FAILED = 1


class BoxMotion:
    """A run from (x, μ) at the time t0 (`runs.Stepper`), within `numbers.user_working()`.

    Only a box whose steps are calls of their own has a state that can be saved; any other makes its
    run at once.
    """

    error: BoxRaised

    def __init__(self, flow: BoxFlow, x: Vector, mu: Vector, t0: Exact) -> None:
        self.flow, self.start, self.t0 = flow, (x, mu), t0
        self.name, self.numbers = flow.name, flow.numbers
        self.index, self.whole, self.ended = 0, 0, False

    def begin(self, steps: int, every: int, allocate: Allocate | None) -> None:
        """Write the start in the box's own coordinates; its row comes with the first steps."""
        self.steps, self.every, flow = steps, every, self.flow
        x, mu = (((len(part),), self.numbers.dtype) for part in self.start)
        make = allocate or partial(allocated, numbers=self.numbers)
        self.rows = make({"x": x, "mu": mu}, steps // every + 1)
        self.at = flow._written(*self.start, self.t0)

    def _row(self, k: int, q: Vector, p: Vector) -> None:
        x, mu = self.flow._read(q, p, k, self.t0)
        self.rows["x"][self.whole], self.rows["mu"][self.whole] = map(self.numbers.own, (x, mu))
        self.whole += 1

    def advance(self) -> int:
        """Make CHUNK steps, or the whole run."""
        calls, left = self.flow._calls, self.steps - self.index
        count = min(left, CHUNK) if calls.by_steps else left
        try:
            self.at = calls.run(*self.at, count, self.every, self._time, self._row, self.index)
        except BoxRaised as error:
            self.error = error
            return FAILED
        self.index += count
        self.ended = self.index == self.steps
        return 0

    def _time(self, k: int) -> None:
        self.flow._at(k, self.t0)

    @property
    def key(self) -> str:
        """What the box and the scene read, and the start; raises as `_read_text`."""
        self.text = self._read_text()
        flow, start = self.flow, self.numbers.own(np.concatenate(self.start))
        return " ".join(map(str, (self.text, flow.step, flow.digits, self.t0, *start)))

    def _read_text(self) -> str:
        """Return the digest of all that the box reads.

        Raises `BadInput` for a box with a memory, and for one of which a change cannot be detected.
        """
        why = "a step needs more than the state"
        if self.flow._calls.by_steps:
            try:
                return reads(self.flow.scheme.rule, self.flow.scheme.scene, pure=True)
            except Opaque as error:
                why = f"it depends on {error}"
        raise self._no_file(why)

    def _no_file(self, why: str) -> BadInput:
        return BadInput(
            f"{self.name}: a run of the black box {self.flow.scheme.rule.name} cannot go on from a "
            f"file, since {why}: leave checkpoint= out."
        )

    @property
    def state(self) -> Mapping[str, np.ndarray]:
        """q and p in the box's own coordinates; raises `BadInput` for a box that changes as it
        runs.
        """
        if self._read_text() != self.text:
            raise self._no_file("its steps change what it reads")
        q, p = map(self.numbers.own, self.at)
        return {"q": q, "p": p, "at": np.array([self.index, self.whole], np.int64)}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Continue from a saved state."""
        q, p = (self.numbers.public(state[word]) for word in ("q", "p"))
        self.at = q.astype(self.flow.kind), p.astype(self.flow.kind)
        self.index, self.whole = state["at"].tolist()
        self.ended = self.index == self.steps

    def _rows(self) -> tuple[np.ndarray, np.ndarray]:
        x, mu = (self.numbers.public(self.rows[word][: self.whole]) for word in ("x", "mu"))
        return x, mu

    def failure(self, status: int) -> StepFailure:
        """Return the failure of the step that the box could not make, with the rows so far."""
        failure = self.flow._failure(self.error, *self._rows(), self.every, self.t0)
        failure.__cause__ = self.error
        return failure

    def trajectory(self) -> Trajectory:
        """Return the rows."""
        return self.flow._rows(*self._rows(), self.steps, self.every, self.t0)
