"""One race: every method climbs its ladder within a budget, then all runs are timed together."""

from __future__ import annotations

import math
import secrets
from collections.abc import Collection, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators import BadInput, StepFailure
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.rules import Discretisation
from discmech.integrators.scene import Scene

from ..core.case import Progress, scheme_of
from ..core.clocks import fine_clock
from ..core.record import provenance
from ..core.study import BY_TOLERANCE
from .accuracy import Yardstick
from .contestants import Contestant, NoEnd, Problem, RuleContestant, ToleranceContestant
from .enough import FEWEST, PATIENT, errors_of
from .peers import peer
from .peers.equations import Equations, equations_of
from .racing import LEAST, race
from .records import ERRORS, WORK
from .standings import Climb, points, reached, summary

#: factor of the budget that the timing may take: the least rounds of all runs use up one (a ladder
#: ends there), the rest is for runs whose median is still unknown
REPEATING = 2
TALL = 5  # factor of the budget of a peer that is less accurate than a rule
GIVEN_UP = 4  # after so many runs without an end within the budget no other is tried


def hold_race(
    scene: Scene,
    rules: Sequence[Discretisation],
    peers: Sequence[str],
    *,
    axes: tuple[str, str],
    budget: float,
    periods: int | None,
    wanted: Collection[str],
    first: int | None,
    progress: Progress,
) -> dict[str, dict[str, Any]]:
    """Return per method {rows, measured, floor, ...}; see `studies.work_precision.measure`.

    `budget`: seconds of the least timing of a method; all of them together may take `REPEATING`
    times as many until their medians are known. wanted: the names of the methods that take part; a
    rule with stages may do so twice, the second time with steps chosen for tolerances. `first`:
    steps of the rules' first run.
    """
    scheme = scheme_of(scene, rules[0])
    equations = equations_of(scheme, timed=bool(peers))
    problem = Problem(scene, scheme, scene.duration)
    if periods is not None:
        duration = Fraction(periods * characteristic_period(problem, equations))
        problem = Problem(scene, scheme, duration.limit_denominator(64), checkpoints=0)
    problem = replace(problem, patience=budget)
    yardstick = Yardstick(problem, equations)
    if axes[1] not in yardstick.floors:
        where = scene.name if periods is None else f"a race of {scene.name} over many periods"
        known = ", ".join(m for m in ERRORS if m in yardstick.floors)
        raise BadInput(f"--y {axes[1]} does not exist in {where}: choose {known}.")
    fixed = [RuleContestant(problem, rule, first) for rule in rules
             if {rule.name, rule.name + BY_TOLERANCE} & {*wanted}]  # fmt: skip
    staged = [ToleranceContestant(one) for one in fixed if one.name + BY_TOLERANCE in wanted]
    ours = [one for one in (*fixed, *staged) if one.name in wanted]
    alike = _one_method(ours)
    entrants: list[Contestant] = [one for one in ours if one.name not in alike]
    entrants += [peer(name, problem, equations) for name in peers if name in wanted]
    climbs = list[Climb]()
    for i, contestant in enumerate(entrants):
        progress(f"{scene.name}: {contestant.name}", i / len(entrants) / 2)
        heights = [reached(one, axes[1]) for one in climbs if one.contestant.kind == "rule"]
        height = min(heights, default=math.inf) if contestant.kind == "peer" else math.inf
        climbs.append(climb(contestant, yardstick, axes[1], budget, height))
    progress(f"{scene.name}: timing", 0.5)
    timed = [pair for each in climbs for pair in each.runs]
    timings = race([run for _, run in timed], REPEATING * budget * len(entrants))
    for (row, _), timing in zip(timed, timings, strict=True):
        row |= {"seconds": timing.median, "seconds_low": timing.low, "seconds_high": timing.high,
                "samples": timing.samples, "outliers": timing.outliers}  # fmt: skip
    run = {"run": secrets.token_hex(4), "date": provenance().date,
           "with": [*(one.name for one in ours), *(name for name in peers if name in wanted)],
           "peers": {each.contestant.name: points(each.rows, axes)
                     for each in climbs if each.contestant.kind == "peer"}}  # fmt: skip
    whole = {"floor": yardstick.floors, "duration": float(problem.duration), "periods": periods}
    summaries = {
        each.contestant.name: {**whole, **summary(each, axes), "race": {
            **run, "step": getattr(each.contestant, "equations", None)}}
        for each in climbs
    }  # fmt: skip
    return summaries | {name: summaries[leader] for name, leader in alike.items()}


def _one_method(rules: Sequence[RuleContestant]) -> dict[str, str]:
    """Return rules with the step of an earlier one → its name; they run once for shared rows."""
    first: dict[str, str] = {}
    leaders = {rule.name: first.setdefault(rule.equations, rule.name) for rule in rules}
    return {name: leader for name, leader in leaders.items() if name != leader}


def climb(
    contestant: Contestant,
    yardstick: Yardstick,
    metric: str,
    budget: float,
    height: float = math.inf,
) -> Climb:
    """Run the ladder until the error no longer sinks near its floor or the budget is used up.

    The budget covers `LEAST` timed rounds of every run; a setting that would exceed it is cut, and
    the row says so. A rule may take `PATIENT` times as much for the `FEWEST` runs that its verdict
    needs, and a peer `TALL` times as much until its error is that of the most accurate rule,
    `height`: else an accuracy that a rule reaches late seems to be its alone. A method that fails
    at one setting may work at the next; but after `GIVEN_UP` runs without an end within the budget,
    or as many that failed after a good one, no other is tried.
    """
    ascent, clock = Climb(contestant), fine_clock()
    spent, before, growth = 0.0, 0.0, 2.0
    best, since, lost = math.inf, 0, 0
    for setting in contestant.ladder():
        told = contestant.told(setting)
        if lost == GIVEN_UP:
            ascent.cut = f"{told['setting']}, since {lost} settings failed"
            break
        few = contestant.kind == "rule" and len(errors_of(ascent.rows, metric)) < FEWEST
        more = PATIENT if few else TALL if best > height else 1
        if spent + before * growth * LEAST > budget * more:
            needed = before * growth
            ascent.cut = f"{told['setting']}, about {needed:.2g} s"
            break
        row: dict[str, Any] = {**told, **dict.fromkeys((*ERRORS, "growth", *WORK)), "cause": ""}
        ascent.rows.append(row)
        try:
            run = contestant.prepare(setting)
            states = run.states()
        except (StepFailure, CannotMeasure, BadInput) as failure:
            row["cause"] = getattr(failure, "cause", "") or str(failure)
            row["steps"] = getattr(failure, "step_index", None)
            lost += bool(ascent.runs) or isinstance(failure, NoEnd)
            continue
        errors = {k: v for k, v in yardstick.errors(states).items() if math.isfinite(v)}
        if metric not in errors:
            row["cause"] = "the numbers are no longer finite"
            continue
        begun = clock()
        run()
        seconds = clock() - begun
        growth = min(max(seconds / before, 1.2), 4.0) if before else 2.0
        before, spent = seconds, spent + LEAST * seconds
        row |= {**errors, **states.more}
        row |= {"steps": states.steps, "evaluations": states.evaluations,
                "iterations": states.iterations, "seconds": seconds}  # fmt: skip
        ascent.runs.append((row, run))
        since = 0 if errors[metric] < 0.7 * best else since + 1
        best = min(best, errors[metric])
        if since >= 3 and best < 1e4 * yardstick.floors[metric]:
            break
    return ascent


def characteristic_period(problem: Problem, equations: Equations) -> float:
    """Return 2π/ω, with ω² the mean over the components of z = (x, μ) of ⟨żᵢ²⟩ / ⟨(zᵢ − z̄ᵢ)²⟩.

    On the harmonic oscillator over whole periods this is its period. Components that stay constant
    do not count.
    """
    scene = problem.scene
    run = problem.scheme.flow(scene.step / 4).trajectory(4 * scene.steps_for(scene.step))
    states = np.hstack([run.base, run.mu])
    rates = np.array([equations.f(0.0, z) for z in states])
    spread, speed = states.var(axis=0), (rates**2).mean(axis=0)
    moving = spread > 1e-12 * (states**2).mean(axis=0)
    if not moving.any():
        raise CannotMeasure(f"{scene.name} is at rest: it has no period.")
    return 2 * math.pi / math.sqrt(float((speed[moving] / spread[moving]).mean()))
