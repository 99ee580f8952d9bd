"""Who takes part in a race: a rule of ours, or a peer; what a run of one hands out."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any

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
    evaluations: int | None = None
    iterations: int | None = None
    more: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def along(cls, problem: Problem, path: np.ndarray, *work: Any) -> States:
        """Of states at equal distances, the checkpoints among them (`steps_between`)."""
        if not problem.checkpoints:
            return cls(path[:0], path, *work)
        stride = (len(path) - 1) // math.gcd(problem.checkpoints, len(path) - 1)
        return cls(path[stride::stride], path, *work)


def steps_between(problem: Problem, steps: int) -> int:
    """Each how-many-th of so many steps is kept: `MOST_ROWS` at most, the checkpoints among them.

    A pilot's steps are a multiple of eight alone: there each second checkpoint is left out.
    """
    inside = steps // math.gcd(problem.checkpoints, steps) if problem.checkpoints else steps
    every = max(1, math.ceil(steps / MOST_ROWS))
    while inside % every:
        every += 1
    return every


class NoEnd(CannotMeasure):
    """A run that did not come to its end within the problem's patience."""

    def __init__(self, name: str, more: str = "") -> None:
        super().__init__(f"{name} came to no end within the budget{more}")


class Run:
    """One run, prepared: calling it is what is timed, from the start to the end."""

    def __init__(self, contestant: Contestant, setting: Any) -> None:
        self.contestant, self.made = contestant, contestant.made(setting)

    def __call__(self) -> object:
        return self.contestant.solve(self.made)

    def states(self) -> States:
        """The same run once more, with what has to be looked at."""
        found: States = self.contestant.states(self.made)
        return found


class Contestant:
    """One method in a race; its settings are numbers of steps (`int`) or tolerances.

    made(setting): all that need not be timed; raises `BadInput` or `StepFailure` where there is no
    such run. solve(made), states(made): as of a `Run`. setup: seconds to derive and compile. what:
    how its tolerance is called.
    """

    kind = "peer"
    name: str
    problem: Problem
    setup = 0.0
    settings: Sequence[Any]  # cheapest first
    what = "rtol"
    solve: Any
    states: Any

    def made(self, setting: Any) -> Any:
        """Nothing, where a run is solved with its setting alone."""
        return setting

    def ladder(self) -> Iterator[Any]:
        """Settings, cheapest first."""
        return iter(self.settings)

    def prepare(self, setting: Any) -> Run:
        """The run with that setting."""
        return Run(self, setting)

    def told(self, setting: Any) -> dict[str, Any]:
        """The setting in a row of the result."""
        if isinstance(setting, int):
            step = float(self.problem.duration / setting)
            return {"setting": f"{setting} steps", "step": step}
        return {"setting": f"{self.what} {setting:.0e}", "tolerance": setting}


class RuleContestant(Contestant):
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
        if not self.rule.is_formula:  # of a program nothing tells but that it is itself
            return f"{self.rule.name} {id(self.rule)}"
        system = self.scheme.flow(self.problem.duration / self.first).system
        constants = [str(value(60)) for value in system.constants.values()]
        shares = [f"{part.coefficient(60)} {part.adjoint}" for part in self.scheme.substeps]
        return text_key(system, *constants, *shares)

    def ladder(self) -> Iterator[int]:
        """Numbers of steps, doubled on and on: first a quarter of what the scene's own step makes,
        and for an order p > 2 the part 1/(4p) of it."""
        return (self.first * 2**k for k in range(40))

    def made(self, setting: Any, more: Any = None) -> Any:
        """The flow, its coefficients computed; more: what stands in the row."""
        flow = self.scheme.flow(self.problem.duration / setting)
        flow.trajectory(0)
        return flow, setting, more or {}

    def solve(self, made: Any) -> object:
        """A trajectory that keeps the end alone, which peers have at hand when they return."""
        flow, steps, _ = made
        run = flow.trajectory(steps, every=steps)
        return run.base[-1], run.mu[-1]

    def states(self, made: Any) -> States:
        """Rows at equal distances, the checkpoints among them."""
        flow, steps, more = made
        run = flow.trajectory(steps, every=steps_between(self.problem, steps))
        corrections = round(run.newton_mean * (steps + 1))
        evaluations = corrections + steps  # `correct` or `direct`, and `update`
        path = np.hstack([run.base, run.mu])
        return States.along(self.problem, path, steps, evaluations, corrections, more)


class ToleranceContestant(RuleContestant):
    """A rule of ours whose step is chosen for a tolerance, as a user does who asks for one.

    The pilot that chooses it has no part in the time of a run: its seconds stand in the row. Over
    many periods the step is the one for the scene's own duration.
    """

    what, settings = "tolerance", TOLERANCES
    ladder = Contestant.ladder

    def __init__(self, fixed: RuleContestant) -> None:
        self.problem, self.rule, self.scheme = fixed.problem, fixed.rule, fixed.scheme
        self.fixed, self.name, self.spent = fixed, fixed.name + BY_TOLERANCE, 0.0
        begun = time.perf_counter()
        with suppress(BadInput):  # what large steps need beside is compiled; the ladder tells more
            self.scheme.flow(tolerance=TOLERANCES[0])
        self.setup = fixed.setup + time.perf_counter() - begun

    @property
    def equations(self) -> str:
        """What tells its step from any other's."""
        return self.fixed.equations + BY_TOLERANCE

    def made(self, setting: Any, more: Any = None) -> Any:
        """At the step that the pilot chose; raises `NoEnd` once pilots cost too much."""
        problem = self.problem
        if self.spent > PATIENT * problem.patience:
            raise NoEnd(self.name, f": choosing steps took {self.spent:.2g} s")
        begun = time.process_time()
        try:
            choice = self.scheme.flow(tolerance=setting).choice
        finally:
            pilot = time.process_time() - begun
            self.spent += pilot
        assert choice is not None
        steps = math.ceil(problem.duration / choice.step)
        if not problem.checkpoints and steps > MOST_ROWS:  # rows at equal distances, the end too
            steps = math.ceil(steps / MOST_ROWS) * MOST_ROWS
        chosen = {"step": float(problem.duration / steps), "promised": choice.error}
        return super().made(steps, {**chosen, "pilot": pilot})
