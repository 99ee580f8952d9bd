"""Who takes part in a race: a rule of ours, or a peer; what a run of one hands out.

A contestant has a name, a kind, a ladder of settings from cheap to accurate (a number of steps, or
a tolerance), and `prepare(setting)`: a run, with everything done that need not be timed.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from discmech.integrators import BadInput, Scheme
from discmech.integrators.compiler import text_key
from discmech.integrators.errors import CannotMeasure, StepFailure
from discmech.integrators.rules import Discretisation
from discmech.integrators.scene import Scene

from ..core.case import scheme_of
from ..core.study import BY_TOLERANCE
from .enough import PATIENT

CHECKPOINTS = 16  # times at which (x, μ) is compared with the reference
MOST_ROWS = 2**14  # states kept of a run for its invariants
MOST_DOUBLED = 8  # times that a ladder's first number of steps is doubled, for stages to contract
TOLERANCES = [10.0**-k for k in range(2, 15)]  # for which a rule's step is chosen


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

    checkpoints (k, n+m): (x, μ) at the problem's times, or at each second, fourth, ... of them;
    path (r, n+m): states along the run, the first its start, the last its end. steps, evaluations
    (of the right-hand side or of a kernel), iterations (Newton corrections): None where the method
    does not tell. more: what else its row has.
    """

    checkpoints: np.ndarray
    path: np.ndarray
    steps: int
    evaluations: int | None
    iterations: int | None
    more: dict[str, Any] = field(default_factory=dict)


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


def lines_of(rule: Discretisation) -> list[str]:
    """The names under which a rule of ours takes part: one with stages by tolerance too."""
    return [rule.name, *([rule.name + BY_TOLERANCE] if rule.stages else [])]


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
        if first is None:
            self._contract()
        with suppress(StepFailure):  # compiled it is anyway; the ladder tells what fails
            self.scheme.flow(problem.duration / self.first).trajectory(1)
        self.setup = time.perf_counter() - begun

    def _contract(self) -> None:
        """Begin where the fixed point of stages contracts, if it does: what larger steps need,
        Newton's method, is no cheaper and takes up to minutes to compile."""
        for steps in (self.first * 2**k for k in range(MOST_DOUBLED)):
            flow = self.scheme.flow(self.problem.duration / steps)
            if flow.stages is None:
                return
            flow.stages.alone = True
            with suppress(StepFailure):
                flow.trajectory(steps, every=steps)
                self.first = steps
                return

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


class ToleranceContestant:
    """A rule of ours whose step is chosen for a tolerance, as a user does who asks for one.

    The pilot that chooses it has no part in the time of a run: its seconds stand in the row. Over
    many periods the step is the one for the scene's own duration.
    """

    kind = "rule"

    def __init__(self, fixed: RuleContestant) -> None:
        self.fixed, self.name = fixed, fixed.name + BY_TOLERANCE
        self.equations, self.spent = fixed.equations + BY_TOLERANCE, 0.0
        begun = time.perf_counter()
        with suppress(BadInput):  # what large steps need beside is compiled; the ladder tells more
            fixed.scheme.flow(tolerance=TOLERANCES[0])
        self.setup = fixed.setup + time.perf_counter() - begun

    def ladder(self) -> Iterator[float]:
        """Tolerances from 1e-2 on."""
        return iter(TOLERANCES)

    def told(self, setting: float) -> dict[str, Any]:
        """Its tolerance."""
        return {"setting": f"tolerance {setting:.0e}", "tolerance": setting}

    def prepare(self, setting: float) -> RuleRun:
        """The flow at the step that the pilot chose; raises `NoEnd` once pilots cost too much."""
        problem = self.fixed.problem
        if self.spent > PATIENT * problem.patience:
            raise NoEnd(self.name, f": choosing steps took {self.spent:.2g} s")
        begun = time.process_time()
        try:
            choice = self.fixed.scheme.flow(tolerance=setting).choice
        finally:
            pilot = time.process_time() - begun
            self.spent += pilot
        assert choice is not None
        steps = math.ceil(problem.duration / choice.step)
        if not problem.checkpoints and steps > MOST_ROWS:  # rows at equal distances, the end too
            steps = math.ceil(steps / MOST_ROWS) * MOST_ROWS
        chosen = {"step": float(problem.duration / steps), "promised": choice.error}
        return RuleRun(self.fixed, steps, {**chosen, "pilot": pilot})


class RuleRun:
    """A trajectory of which the timed run keeps the end alone; `more` stands in its row."""

    def __init__(self, contestant: RuleContestant, steps: int, more: Any = None) -> None:
        self.problem, self.steps, self.more = contestant.problem, steps, more or {}
        self.flow = contestant.scheme.flow(self.problem.duration / steps)
        self.flow.trajectory(0)

    def __call__(self) -> object:
        run = self.flow.trajectory(self.steps, every=self.steps)
        return run.base[-1], run.mu[-1]  # which peers have at hand when they return

    def states(self) -> States:
        """Rows at equal distances, the checkpoints among them."""
        # a pilot's steps are a multiple of eight alone: there each second checkpoint is left out
        parts = math.gcd(self.problem.checkpoints, self.steps) if self.problem.checkpoints else 1
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
            self.more,
        )
