"""One race: every method climbs its ladder within a budget, then all runs are timed together."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np

from integrators import BadInput, StepFailure
from integrators.discretisations import Discretisation
from integrators.errors import CannotMeasure
from integrators.scene import Scene

from .accuracy import METRICS, Yardstick
from .case import Progress, scheme_of
from .contestants import CHECKPOINTS, Contestant, Problem, RuleContestant, Run
from .peers import peer
from .peers.equations import Equations, equations_of
from .racing import LEAST, race

#: what can be on the horizontal axis: key → words
WORK = {
    "seconds": "run time",
    "steps": "steps",
    "evaluations": "evaluations of the right-hand side or of a kernel",
    "iterations": "Newton iterations",
}
REACHED = (1e-4, 1e-8, 1e-12)  # accuracies whose cost is told


@dataclass
class Climb:
    """A contestant's runs up to where the budget or round-off ended them."""

    contestant: Contestant
    rows: list[dict[str, Any]] = field(default_factory=list)
    runs: list[tuple[dict[str, Any], Run]] = field(default_factory=list)  # rows that can be timed
    cut: str = ""


def hold_race(
    scene: Scene,
    rules: Sequence[Discretisation],
    peers: Sequence[str],
    *,
    axes: tuple[str, str],
    budget: float,
    periods: int | None,
    first: int | None,
    progress: Progress,
) -> dict[str, dict[str, Any]]:
    """Per method {rows, measured, floor, ...}; see `studies.work_precision.measure`.

    `budget`: seconds of timing for all methods together. `first`: steps of the rules' first run.
    """
    scheme = scheme_of(scene, rules[0])
    equations = equations_of(scheme)
    problem = Problem(scene, scheme, scene.duration)
    if periods is not None:
        duration = Fraction(periods * characteristic_period(problem, equations))
        problem = Problem(scene, scheme, duration.limit_denominator(64), checkpoints=0)
    yardstick = Yardstick(problem, equations)
    entrants: list[Contestant] = [RuleContestant(problem, rule, first) for rule in rules]
    entrants += [peer(name, problem, equations) for name in peers]
    climbs = []
    for i, contestant in enumerate(entrants):
        progress(f"{scene.name}: {contestant.name}", i / len(entrants) / 2)
        metric = axes[1] if axes[1] in yardstick.floors else next(iter(yardstick.floors))
        climbs.append(climb(contestant, yardstick, metric, budget / len(entrants)))
    progress(f"{scene.name}: timing", 0.5)
    timed = [pair for each in climbs for pair in each.runs]
    for (row, _), timing in zip(timed, race([run for _, run in timed], budget), strict=True):
        row |= {"seconds": timing.median, "seconds_low": timing.low, "seconds_high": timing.high,
                "samples": timing.samples, "outliers": timing.outliers}  # fmt: skip
    whole = {"floor": yardstick.floors, "duration": float(problem.duration), "periods": periods,
             "crossovers": crossovers(climbs, axes)}  # fmt: skip
    return {each.contestant.name: {**whole, **summary(each, climbs, axes)} for each in climbs}


def climb(contestant: Contestant, yardstick: Yardstick, metric: str, budget: float) -> Climb:
    """Run the ladder until the error no longer sinks near its floor or the budget is used up.

    The budget covers `LEAST` timed rounds of every run; a setting that would exceed it is cut, and
    the row says so. What fails at one setting may go well at the next.
    """
    found = Climb(contestant)
    left, before, growth = budget, 0.0, 2.0
    best, since = math.inf, 0
    for setting in contestant.ladder():
        told = contestant.told(setting)
        if before * growth * LEAST > left:
            needed = before * growth
            found.cut = f"{told['setting']}, about {needed:.2g} s"
            break
        row: dict[str, Any] = {**told, **dict.fromkeys((*METRICS, *WORK)), "cause": ""}
        found.rows.append(row)
        try:
            run = contestant.prepare(setting)
            states = run.states()
        except (StepFailure, CannotMeasure, BadInput) as failure:
            row["cause"] = getattr(failure, "cause", "") or str(failure)
            continue
        errors = {k: v for k, v in yardstick.errors(states).items() if math.isfinite(v)}
        if metric not in errors:
            row["cause"] = "the numbers are no longer finite"
            continue
        begun = time.process_time()
        run()
        seconds = time.process_time() - begun
        growth = min(max(seconds / before, 1.2), 4.0) if before else 2.0
        before, left = seconds, left - LEAST * seconds
        row |= errors
        row |= {"steps": states.steps, "evaluations": states.evaluations,
                "iterations": states.iterations, "seconds": seconds}  # fmt: skip
        found.runs.append((row, run))
        since = 0 if errors[metric] < 0.7 * best else since + 1
        best = min(best, errors[metric])
        if since >= 3 and best < 1e4 * yardstick.floors[metric]:
            break
    return found


def summary(each: Climb, climbs: Sequence[Climb], axes: tuple[str, str]) -> dict[str, Any]:
    """{rows, measured, kind, setup}: what each accuracy costs, beside the best peer's cost."""
    costs = cost(each.rows, axes)
    others = [cost(c.rows, axes) for c in climbs if c.contestant.kind == "peer"]
    ratio = {}
    for accuracy, value in costs.items():
        best = min((c for o in others if (c := o[accuracy]) is not None), default=None)
        ratio[accuracy] = value / best if value is not None and best else None
    errors = [row[axes[1]] for row in each.rows if row[axes[1]] is not None]
    return {
        "rows": each.rows,
        "kind": each.contestant.kind,
        "measured": {
            "x": axes[0],
            "y": axes[1],
            "best": min(errors, default=None),
            "cost": costs,
            "ratio": ratio,
            "cut": each.cut,
            "setup": getattr(each.contestant, "setup", None),
        },
    }


def crossovers(climbs: Sequence[Climb], axes: tuple[str, str]) -> list[dict[str, Any]]:
    """Where the fastest rule and the fastest peer change places: [{error, work, tighter}].

    `tighter` is the kind that is faster at tighter accuracies. Only accuracies count that both
    kinds reach, so what one of them cannot reach at all is no crossover.
    """
    grid = [10.0 ** (-k / 8) for k in range(8 * 15)]
    best: dict[str, list[float]] = {}
    for kind in ("rule", "peer"):
        curves = [cost(c.rows, axes, grid) for c in climbs if c.contestant.kind == kind]
        best[kind] = [
            min((v for curve in curves if (v := curve[accuracy]) is not None), default=math.inf)
            for accuracy in map(_key, grid)
        ]
    found, before = [], None
    for error, rule, other in zip(grid, best["rule"], best["peer"], strict=True):
        if math.isinf(rule) or math.isinf(other):
            continue
        faster = "rule" if rule < other else "peer"
        if before not in (None, faster):
            found.append({"error": error, "work": max(rule, other), "tighter": faster})
        before = faster
    return found


def _key(accuracy: float) -> str:
    return f"{accuracy:.0e}" if accuracy in REACHED else f"{accuracy:.3e}"


def cost(
    rows: Sequence[dict[str, Any]], axes: tuple[str, str], accuracies: Sequence[float] = REACHED
) -> dict[str, float | None]:
    """Per accuracy the least work that reaches it, interpolated in log–log; None if none does."""
    points = sorted(
        (row[axes[0]], max(row[axes[1]], 1e-300))
        for row in rows
        if row[axes[0]] and row[axes[1]] is not None
    )
    found: dict[str, float | None] = {}
    for accuracy in accuracies:
        at = next((i for i, (_, error) in enumerate(points) if error <= accuracy), None)
        value = None if at is None else points[at][0]
        if at:  # between the run before, which is not as accurate, and this one
            (w0, e0), (w1, e1) = points[at - 1], points[at]
            part = math.log(e0 / accuracy) / math.log(e0 / e1)
            value = w0 * (w1 / w0) ** part
        found[_key(accuracy)] = value
    return found


def characteristic_period(problem: Problem, equations: Equations) -> float:
    """2π/ω, with ω² the mean over the components of z = (x, μ) of ⟨żᵢ²⟩ / ⟨(zᵢ − z̄ᵢ)²⟩.

    On the harmonic oscillator over whole periods this is its period. Components that stay
    constant do not count.
    """
    scene = problem.scene
    run = problem.scheme.flow(scene.step / 4).trajectory(4 * scene.steps_for(scene.step))
    states = np.hstack([run.x, run.mu])
    rates = np.array([equations.f(0.0, z) for z in states])
    spread, speed = states.var(axis=0), (rates**2).mean(axis=0)
    moving = spread > 1e-12 * (states**2).mean(axis=0)
    if not moving.any():
        raise CannotMeasure(f"{scene.name} is at rest: it has no period.")
    return 2 * math.pi / math.sqrt(float((speed[moving] / spread[moving]).mean()))


__all__ = ["CHECKPOINTS", "REACHED", "WORK", "cost", "hold_race"]
