"""The contestants of a race: rules of ours, and peers, with their runs."""

from __future__ import annotations

import itertools
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
from ..core.clocks import fine_clock
from ..core.study import BY_TOLERANCE
from .enough import PATIENT

CHECKPOINTS = 16  # times at which (x, μ) is compared with the reference
MOST_ROWS = 2**14  # states of a run that are kept for its invariants
#: starts of timed calls, none like another; a run has fewer calls, and units of its last bits as
#: many move a start by 10⁻¹², which costs no method more
STARTS = 2**12
MOST_DOUBLED = 8  # how often a ladder's first number of steps is doubled, until stages contract
TOLERANCES = [10.0**-k for k in range(2, 15)]  # tolerances for which a rule's step is chosen


@dataclass(frozen=True)
class Problem:
    """A scene from its start to `duration`, with `checkpoints` equal stretches.

    patience: seconds after which an unfinished run is given up.
    """

    scene: Scene
    scheme: Scheme  # it gives symbols and the equations of motion
    duration: Fraction
    checkpoints: int = CHECKPOINTS
    patience: float = math.inf

    @property
    def times(self) -> list[Fraction]:
        """The checkpoints; the last is the end."""
        return [self.duration * (k + 1) / self.checkpoints for k in range(self.checkpoints)]

    @cached_property
    def start(self) -> np.ndarray:
        """(x₀, μ₀) in double precision, (n+m,); if time enters it is the last entry of x."""
        run = self.scheme.flow(self.scene.step).trajectory(0)
        return np.concatenate([run.base[0], run.mu[0]])

    @cached_property
    def places(self) -> list[int]:
        """The places of (x, μ) in a state: all except the time."""
        n, s = len(self.scheme.x), self.scheme.s
        return [i for i in range(len(self.start)) if not s.clocked or i != n - 1]

    @cached_property
    def starts(self) -> np.ndarray:
        """Starts that differ from the problem's in their last bits, and from each other, (k, n+m).

        Each timed call has another, so that nobody answers it from a memory of an earlier one.
        Entries that are zero stay zero unless all are.
        """
        own = self.start[self.places]
        units = np.where(own == 0, 0.0 if own.any() else 2.0**-52, np.spacing(np.abs(own)))
        moved = np.tile(self.start, (STARTS, 1))
        drawn = np.random.default_rng(0)
        moved[:, self.places] += units * np.array([drawn.permutation(STARTS) for _ in own]).T
        return moved


@dataclass(frozen=True)
class States:
    """The states of an untimed run, and its work.

    checkpoints (k, n+m): (x, μ) at the problem's times, or at each second, fourth, ... of them;
    path (r, n+m): states along the run, the first its start, the last its end. steps, evaluations
    (of the right-hand side or of a kernel), iterations (Newton corrections): None if the method
    does not count them. more: further entries of its row.
    """

    checkpoints: np.ndarray
    path: np.ndarray
    steps: int
    evaluations: int | None = None
    iterations: int | None = None
    more: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def along(cls, problem: Problem, path: np.ndarray, *work: Any) -> States:
        """Return the states of an even path that includes the checkpoints (`steps_between`)."""
        if not problem.checkpoints:
            return cls(path[:0], path, *work)
        stride = (len(path) - 1) // math.gcd(problem.checkpoints, len(path) - 1)
        return cls(path[stride::stride], path, *work)


def steps_between(problem: Problem, steps: int) -> int:
    """Return k to keep every k-th of so many steps: at most `MOST_ROWS`, including the checkpoints.

    A pilot's steps are a multiple of eight alone: there each second checkpoint is left out.
    """
    inside = steps // math.gcd(problem.checkpoints, steps) if problem.checkpoints else steps
    every = max(1, math.ceil(steps / MOST_ROWS))
    while inside % every:
        every += 1
    return every


class NoEnd(CannotMeasure):
    """A run that did not reach its end within the problem's patience."""

    def __init__(self, name: str, more: str = "") -> None:
        super().__init__(f"{name} came to no end within the budget{more}")


class Run:
    """One prepared run: the timing covers a call, from a start of its own to the end."""

    def __init__(self, contestant: Contestant, setting: Any) -> None:
        self.contestant, self.made = contestant, contestant.made(setting)
        self.starts, self.waiting = itertools.cycle(contestant.problem.starts), list[Any]()

    def ready(self, calls: int) -> None:
        """Prepare the starts of so many calls."""
        missing = itertools.islice(self.starts, max(0, calls - len(self.waiting)))
        self.waiting += [self.contestant.begun(self.made, start) for start in missing]

    def __call__(self) -> object:
        if not self.waiting:
            self.ready(1)
        return self.contestant.solve(self.made, self.waiting.pop())

    def states(self) -> States:
        """Return the states of the same run, made once more."""
        states: States = self.contestant.states(self.made)
        return states


class Contestant:
    """One method in a race; its settings are numbers of steps (`int`) or tolerances.

    made(setting), begun(made, start): everything that need not be timed, of a setting and of a
    start (n+m,); `made` raises `BadInput` or `StepFailure` if there is no such run. solve(made,
    begun), states(made): as in a `Run`; states are those from the problem's own start. setup:
    seconds to derive and compile. what: the name of its tolerance.
    """

    kind = "peer"
    name: str
    problem: Problem
    setup = 0.0
    settings: Sequence[Any]  # the cheapest first
    what = "rtol"
    solve: Any
    states: Any

    def made(self, setting: Any) -> Any:
        """Return the prepared part of a run; here the setting itself."""
        return setting

    def begun(self, made: Any, start: np.ndarray) -> Any:
        """Return a start as `solve` takes it; here the array itself."""
        return start

    def ladder(self) -> Iterator[Any]:
        """Yield settings, the cheapest first."""
        return iter(self.settings)

    def prepare(self, setting: Any) -> Run:
        """Return the run with that setting."""
        return Run(self, setting)

    def told(self, setting: Any) -> dict[str, Any]:
        """Return the setting for a row of the result."""
        if isinstance(setting, int):
            step = float(self.problem.duration / setting)
            return {"setting": f"{setting} steps", "step": step}
        return {"setting": f"{self.what} {setting:.0e}", "tolerance": setting}


class RuleContestant(Contestant):
    """A rule of ours with its compiled flow; the settings are numbers of steps, doubled."""

    kind = "rule"

    def __init__(self, problem: Problem, rule: Discretisation, first: int | None = None) -> None:
        self.problem, self.rule, self.name = problem, rule, rule.name
        self.scheme = scheme_of(problem.scene, rule)
        # a rule of high order has its coarse end at larger steps
        order = rule.order or 2
        fewer = 4 if order <= 2 else 4 * order
        usual = math.floor(problem.duration / problem.scene.step) // fewer
        parts = max(1, problem.checkpoints)
        self.first = max(1, round((first or usual) / parts)) * parts
        begun = time.perf_counter()
        if first is None:
            self._contract()
        with suppress(StepFailure):  # it is compiled anyway; the ladder shows failures
            self.scheme.flow(problem.duration / self.first).trajectory(1)
        self.setup = time.perf_counter() - begun

    def _contract(self) -> None:
        """Start the ladder where the fixed point of stages contracts, if it does.

        Larger steps need Newton's method, which is no cheaper and takes up to minutes to compile.
        """
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
        """The text that identifies its step: two rules with equal texts are one method here."""
        if not self.rule.is_formula:  # a program has no text: it is only equal to itself
            return f"{self.rule.name} {id(self.rule)}"
        system = self.scheme.flow(self.problem.duration / self.first).system
        constants = [str(value(60)) for value in system.constants.values()]
        shares = [f"{part.coefficient(60)} {part.adjoint}" for part in self.scheme.substeps]
        return text_key(system, *constants, *shares)

    def ladder(self) -> Iterator[int]:
        """Yield numbers of steps, doubled repeatedly: first a quarter of the scene's own number.

        For an order p > 2 it is the part 1/(4p).
        """
        return (self.first * 2**k for k in range(40))

    def made(self, setting: Any, more: Any = None) -> Any:
        """Return the flow, with its coefficients computed; more: further entries of the row."""
        flow = self.scheme.flow(self.problem.duration / setting)
        flow.trajectory(0)
        return flow, setting, more or {}

    def begun(self, made: Any, start: np.ndarray) -> dict[str, Any]:
        """Return the arguments of a trajectory; a formula's start is checked and completed here."""
        x, mu = np.split(start, [len(self.problem.scheme.x)])
        flow = made[0]
        return {"x0": flow.starting.at(x, mu)} if self.rule.is_formula else {"x0": x, "mu0": mu}

    def solve(self, made: Any, begun: dict[str, Any]) -> object:
        """Return the end of a trajectory that keeps only it, as peers do."""
        flow, steps, _ = made
        run = flow.trajectory(steps, every=steps, **begun)
        return run.base[-1], run.mu[-1]

    def states(self, made: Any) -> States:
        """Return rows at equal distances, including the checkpoints."""
        flow, steps, more = made
        run = flow.trajectory(steps, every=steps_between(self.problem, steps))
        corrections = round(run.newton_mean * (steps + 1))
        evaluations = corrections + steps  # `correct` or `direct`, and `update`
        path = np.hstack([run.base, run.mu])
        return States.along(self.problem, path, steps, evaluations, corrections, more)


class ToleranceContestant(RuleContestant):
    """A rule of ours whose step is chosen for a tolerance, as for a user who gives one.

    The pilot that chooses it does not count in the time of a run: its seconds are in the row. Over
    many periods the step is the one for the scene's own duration.
    """

    what, settings = "tolerance", TOLERANCES
    ladder = Contestant.ladder

    def __init__(self, fixed: RuleContestant) -> None:
        self.problem, self.rule, self.scheme = fixed.problem, fixed.rule, fixed.scheme
        self.fixed, self.name, self.spent = fixed, fixed.name + BY_TOLERANCE, 0.0
        begun = time.perf_counter()
        # this also compiles the code for large steps; the ladder shows failures
        with suppress(BadInput):
            self.scheme.flow(tolerance=TOLERANCES[0])
        self.setup = fixed.setup + time.perf_counter() - begun

    @property
    def equations(self) -> str:
        """The text that identifies its step."""
        return self.fixed.equations + BY_TOLERANCE

    def made(self, setting: Any, more: Any = None) -> Any:
        """Return the run at the pilot's step; raises `NoEnd` once pilots cost too much."""
        problem = self.problem
        if self.spent > PATIENT * problem.patience:
            raise NoEnd(self.name, f": choosing steps took {self.spent:.2g} s")
        clock = fine_clock()
        begun = clock()
        try:
            choice = self.scheme.flow(tolerance=setting).choice
        finally:
            pilot = clock() - begun
            self.spent += pilot
        assert choice is not None
        steps = math.ceil(problem.duration / choice.step)
        # rows at equal distances, including the end
        if not problem.checkpoints and steps > MOST_ROWS:
            steps = math.ceil(steps / MOST_ROWS) * MOST_ROWS
        chosen = {"step": float(problem.duration / steps), "promised": choice.error}
        return super().made(steps, {**chosen, "pilot": pilot})
