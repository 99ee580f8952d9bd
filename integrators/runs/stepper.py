"""One loop for all runs: a stepper makes steps; the loop has progress, failures and checkpoints."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol, TypeAlias

import numpy as np

from ..errors import CannotMeasure, StepFailure, check_progress
from ..numbers import Arithmetic, Vector, whole_number
from ..numbers.types import Numbers, Rows
from .checkpoint import Checkpoint
from .ensemble import Ensemble, ensemble
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


# What every flow does with its steps: a run from a start, one step, many runs at once.


class FlowRuns:
    """The runs of a flow, whose `trajectory` takes its own kinds of starts."""

    numbers: Arithmetic
    scheme: Any
    #: True if members of an ensemble are run one after another
    in_turn = False

    @property
    def name(self) -> str:
        """The name of the system, for messages."""
        return str(self.scheme.scene.name)

    def trajectory(self, *arguments: Any, **named: Any) -> Trajectory:
        """Run from a start; see the flow's own."""
        raise NotImplementedError

    def _run(
        self,
        stepper: Callable[[], Stepper],
        steps: int,
        every: int,
        progress: Progress,
        checkpoint: File,
    ) -> Trajectory:
        """Run from a start, which `stepper` reads, after the other arguments are checked."""
        steps, every = whole_number("steps", steps, 0), whole_number("every", every, 1)
        check_progress(progress)
        with self.numbers.working():
            return run(stepper(), steps, every, progress, checkpoint)

    def dual_step(self, x: Numbers, mu: Numbers) -> tuple[Vector, Vector]:
        """Return (b, μ′), the step from (x, μ)."""
        rows = self.trajectory(1, x0=x, mu0=mu)
        return rows.base[-1], rows.mu[-1]

    def ensemble(
        self,
        x0s: Rows | None = None,
        mu0s: Rows | None = None,
        steps: Any = None,
        every: int = 1,
        **arguments: Any,
    ) -> Ensemble:
        """Run from many starts at once, on all cores; rows as in `trajectory`, members along axis
        0. Programs run one after another.

        x0s (k, n) and mu0s (k, m), of a lattice (k, N, n) and (k, N, m); None takes the system's
        own for all. steps must be given. arguments: those of `trajectory`, for all members; each
        member has a checkpoint of its own, FILE.0 and so on. A member that fails does not stop the
        others (`Ensemble.failures`). Raises `BadInput` for starts that do not fit.
        """

        def member(index: int, x0: Numbers | None, mu0: Numbers | None) -> Trajectory:
            own = dict(arguments)
            if own.get("checkpoint") is not None:
                own["checkpoint"] = f"{own['checkpoint']}.{index}"
            return self.trajectory(steps, every, x0=x0, mu0=mu0, **own)

        return ensemble(member, x0s, mu0s, self.numbers, self.name, self.in_turn)


#: what a flow has whose step is one map of arrows (x, u), or of (x, μ)
OF_ONE_MAP = frozenset((
    "arrow", "derivatives", "devolve", "elements", "evolve", "gradient", "inverse_legendre",
    "next_arrow", "poisson_defect", "pullback_defect", "solutions", "step_defect", "tangent",
))  # fmt: skip


class NoMap(CannotMeasure, AttributeError):
    """What is measured on a map is asked of a flow whose step is not one."""


class NotOneMap:
    """A flow whose step is not one map, so that it has no form, inverse or Legendre map."""

    @property
    def why_not_one_map(self) -> str:
        """Why, as a sentence."""
        raise NotImplementedError

    def __getattr__(self, name: str) -> Any:
        if name in OF_ONE_MAP:
            raise NoMap(f"there is no {name}: {self.why_not_one_map}")
        raise AttributeError(f"{type(self).__name__} has no {name}", name=name, obj=self)
