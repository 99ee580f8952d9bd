"""One loop for all runs: a stepper makes steps; the loop has progress, failures and checkpoints."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Protocol, TypeAlias

import numpy as np

from ..errors import StepFailure
from ..numbers import Arithmetic
from .checkpoint import Checkpoint
from .trajectory import Allocate, Trajectory

Progress: TypeAlias = Callable[[int], None] | None  # called with the number of steps so far
File: TypeAlias = str | Path | None


class Stepper(Protocol):
    """A run in progress: free motion, collocation, contact or a lattice.

    name: that of the system, for messages. numbers: the arithmetic of its state and rows. ended:
    True after the last step, when all rows are complete.
    """

    name: str
    numbers: Arithmetic
    ended: bool

    @property
    def index(self) -> int:
        """The number of steps done."""

    @property
    def whole(self) -> int:
        """The number of complete rows; one is complete when the u that leaves it is known."""

    @property
    def key(self) -> str:
        """A text that tells this run from every other one, its length and rows apart."""

    def begin(self, steps: int, every: int, allocate: Allocate | None) -> None:
        """Prepare a run of `steps` steps with a row every `every` steps.

        allocate: makes the columns of rows; None: the stepper may take memory in its own way.
        """

    def advance(self) -> int:
        """Make some steps, few enough for an interrupt to be noticed, and write their rows.

        At the last step the last row is completed too. Return 0, or the status of a step that
        failed.
        """

    @property
    def state(self) -> Mapping[str, np.ndarray]:
        """The arrays on which the coming steps depend."""

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Continue from a saved state; `begin` was called before."""

    def failure(self, status: int) -> StepFailure:
        """Return the failure of the coming step, with the rows so far."""

    def trajectory(self) -> Trajectory:
        """Return the rows of a run that is at its end."""


def run(
    stepper: Stepper, steps: int, every: int = 1, progress: Progress = None, checkpoint: File = None
) -> Trajectory:
    """Run `steps` steps with a row every `every` steps, within `numbers.working()`.

    checkpoint: a file to save the state in, from which the same call continues. progress: called
    with the number of steps done. Raises `StepFailure` with the rows so far if a step fails,
    `BadInput` for the checkpoint of another run.
    """
    kept = None
    if checkpoint is None:
        stepper.begin(steps, every, None)
    else:
        key = f"{stepper.key} {steps} {every}"
        kept = Checkpoint(checkpoint, key, stepper.name, stepper.numbers)
        stepper.begin(steps, every, kept.columns)
        if kept.state is not None:
            stepper.restore(kept.state)
        else:  # from here on there is a state for these rows
            kept.save(stepper.state, stepper.whole, at_once=True)
    while not stepper.ended:
        if status := stepper.advance():
            raise stepper.failure(status)
        if kept is not None:
            kept.save(stepper.state, stepper.whole, at_once=stepper.ended)
        if progress is not None:
            progress(stepper.index)
    return stepper.trajectory()
