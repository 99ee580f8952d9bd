"""Who takes part in a race: a rule of ours, or a peer; what a run of one hands out.

A contestant has a name, a kind, a ladder of settings from cheap to accurate (a number of steps, or
a tolerance), and `prepare(setting)`: a run, with everything done that need not be timed.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from discmech.integrators import Scheme
from discmech.integrators.compiler import text_key
from discmech.integrators.errors import CannotMeasure, StepFailure
from discmech.integrators.rules import Discretisation
from discmech.integrators.scene import Scene

from ..core.case import scheme_of

CHECKPOINTS = 16  # times at which (x, μ) is compared with the reference
MOST_ROWS = 2**14  # states kept of a run for its invariants


@dataclass(frozen=True)
class Problem:
    """A scene from its start to `duration`, with `checkpoints` equal stretches.

    patience: seconds after which a run that comes to no end is given up.
    """

    scene: Scene
    scheme: Scheme  # for its symbols and the equations of motion
    duration: Fraction
    checkpoints: int = CHECKPOINTS
    patience: float = math.inf

    @property
    def times(self) -> list[Fraction]:
        """The checkpoints, the last of them the end."""
        return [self.duration * (k + 1) / self.checkpoints for k in range(self.checkpoints)]

    @property
    def start(self) -> np.ndarray:
        """(x₀, μ₀) in double precision, (n+m,); where time enters it is the last entry of x."""
        run = self.scheme.flow(self.scene.step).trajectory(0)
        return np.concatenate([run.base[0], run.mu[0]])


@dataclass(frozen=True)
class States:
    """What an untimed run shows, and its work.

    checkpoints (k, n+m): (x, μ) at the problem's times; path (r, n+m): states along the run, the
    first its start, the last its end. steps, evaluations (of the right-hand side or of a kernel),
    iterations (Newton corrections): None where the method does not tell.
    """

    checkpoints: np.ndarray
    path: np.ndarray
    steps: int
    evaluations: int | None
    iterations: int | None


class NoEnd(CannotMeasure):
    """A run that did not come to its end within the problem's patience."""

    def __init__(self, name: str, more: str = "") -> None:
        super().__init__(f"{name} came to no end within the budget{more}")


class Run(Protocol):
    """One run, prepared: calling it is what is timed."""

    def __call__(self) -> object:
        """From the start to the end."""

    def states(self) -> States:
        """The same run once more, with what has to be looked at."""


class Contestant(Protocol):
    """One method in a race."""

    name: str
    kind: str

    def ladder(self) -> Iterator[Any]:
        """Settings, cheapest first."""

    def prepare(self, setting: Any) -> Run:
        """The run with that setting; raises `BadInput` or `StepFailure` where there is none."""

    def told(self, setting: Any) -> dict[str, Any]:
        """The setting in a row of the result."""


class RuleContestant:
    """A rule of ours with its compiled flow; the settings are numbers of steps, each twice."""

    kind = "rule"

    def __init__(self, problem: Problem, rule: Discretisation, first: int | None = None) -> None:
        self.problem, self.rule, self.name = problem, rule, rule.name
        self.scheme = scheme_of(problem.scene, rule)
        # a rule of high order has its loose end at larger steps
        order = rule.order or 2
        fewer = 4 if order <= 2 else 4 * order
        usual = math.floor(problem.duration / problem.scene.step) // fewer
        parts = max(1, problem.checkpoints)
        self.first = max(1, round((first or usual) / parts)) * parts
        begun = time.perf_counter()
        with suppress(StepFailure):  # compiled it is anyway; the ladder tells what fails
            self.scheme.flow(problem.duration / self.first).trajectory(1)
        self.setup = time.perf_counter() - begun

    @cached_property
    def equations(self) -> str:
        """What tells its step from any other's: two rules with equal ones are one method here."""
        system = self.scheme.flow(self.problem.duration / self.first).system
        constants = [str(value(60)) for value in system.constants.values()]
        shares = [f"{part.coefficient(60)} {part.adjoint}" for part in self.scheme.substeps]
        return text_key(system, *constants, *shares)

    def ladder(self) -> Iterator[int]:
        """Numbers of steps, doubled on and on: first a quarter of what the scene's own step makes,
        and for an order p > 2 the part 1/(4p) of it."""
        return (self.first * 2**k for k in range(40))

    def told(self, setting: int) -> dict[str, Any]:
        """Its steps and step size."""
        return {"setting": f"{setting} steps", "step": float(self.problem.duration / setting)}

    def prepare(self, setting: int) -> RuleRun:
        """The flow at that number of steps, its coefficients computed."""
        return RuleRun(self, setting)


class RuleRun:
    """A trajectory of which the timed run keeps the end alone."""

    def __init__(self, contestant: RuleContestant, steps: int) -> None:
        self.problem, self.steps = contestant.problem, steps
        self.flow = contestant.scheme.flow(self.problem.duration / steps)
        self.flow.trajectory(0)

    def __call__(self) -> object:
        return self.flow.trajectory(self.steps, every=self.steps)

    def states(self) -> States:
        """Rows at equal distances, the checkpoints among them."""
        parts = max(1, self.problem.checkpoints)
        inside = self.steps // parts  # steps from one checkpoint to the next
        every = max(1, math.ceil(self.steps / MOST_ROWS))
        while inside % every:
            every += 1
        run = self.flow.trajectory(self.steps, every=every)
        path = np.hstack([run.base, run.mu])
        corrections = round(run.newton_mean * (self.steps + 1))
        stride = inside // every
        return States(
            path[stride::stride] if self.problem.checkpoints else path[:0],
            path,
            self.steps,
            corrections + self.steps,  # `correct` or `direct`, and `update`
            corrections,
        )
