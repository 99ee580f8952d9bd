"""Order of accuracy in (x, μ): errors on a ladder of step sizes against a certified reference."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any

from discmech import reference
from discmech.integrators import StepFailure
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.numbers import mpmath

from ..causes.round_off import measure_round_off
from ..core.case import Case, Choice, Progress, family_cases, lattice_cases, plain_cases, silent
from ..core.result import StudyResult
from ..systems import End, Ladder, System, system_of
from . import multipliers, recorded, single_steps
from .records import Found, Row, sentences
from .window import REACHED, above_floor, decided, fit, floor, slope_of_multipliers, sunk

NAME = "order"
NEEDS = "it needs a Lagrangian, from which the reference is computed."
DIGITS = (16, 50)
RUNGS, MOST_RUNGS = {True: 9, False: 4}, {True: 16, False: 7}  # in double precision or not


#: times of a program's run whose mean error counts: at one of them it may pass through 0, and there
#: are no more digits that would show it
CHECKED = 4
LARGE = 1e-4  # above this error the next powers of the step still count
BESIDE_EARLY = 0.25  # distance of an order from its limit that such errors may cause
#: rungs of a program's ladder, √2 apart, so that many are above round-off; it ends where errors are
FEWEST, PROGRAM_RUNGS, MOST_PROGRAM_RUNGS = 8, 13, 24
#: part of the duration that runs with more digits take, if the motion is resolved
PART = 40
#: rules of higher order reach round-off after two or three halvings: 50 digits judge them
HIGHEST_IN_DOUBLE = 4
#: from here on few steps are enough: each halving takes three digits and more
HIGH = 8
FAMILY_STEPS = 8  # steps of the family's coarsest run: few, as above `HIGH`


def cases(choice: Choice) -> list[Case]:
    """Return every scene with a Lagrangian with every rule; in double precision too up to order 4.

    Chosen precisions are run for any order.
    """
    on_scenes = [
        c for c in plain_cases(NAME, choice, DIGITS)
        if c.scene.is_continuous
        if choice.digits or c.digits > 16 or (c.rule.order or 0) <= HIGHEST_IN_DOUBLE
        or not c.rule.runs_at(50)
    ]  # fmt: skip
    return [
        *on_scenes,
        *lattice_cases(NAME, choice, more=True),
        *family_cases(NAME, choice, FAMILY_STEPS),
    ]


def notes(choice: Choice) -> list[str]:
    """Return a note on the rules that double precision leaves out."""
    high = [r.name for r in choice.rules
            if (r.order or 0) > HIGHEST_IN_DOUBLE and r.runs_at(50)]  # fmt: skip
    if choice.digits or not high:
        return []
    return [
        f"{', '.join(high)}: with an order above {HIGHEST_IN_DOUBLE}, 16 digits are left out, "
        "since round-off is met after two or three halvings; --digits 16 asks for them."
    ]


def complete(result: StudyResult) -> StudyResult:
    """Return the result with notes on a number that takes several values (`--vary`)."""
    told = sentences(case for case in result.cases if not case.control)
    return replace(result, notes=[*result.notes, *told])


def ladder(case: Case, system: System | None = None) -> Ladder:
    """Return the runs of a case to a time T, each with twice the steps of the one before.

    Double precision runs the scene's whole duration from its own step on, which suits order 2, and
    from coarser ones at higher order; more digits run a fortieth of it in 128 to 1024 steps, where
    round-off does not interfere, and above order 8 in 8 to 64. A motion that such steps do not
    resolve gets a shorter time and shorter ones (`single_steps.resolved`). A program runs a quarter
    of the duration; all of it if it keeps something from step to step, or makes whole runs.
    """
    if (own := (system or system_of(case)).ladder) is not None:
        return own
    duration = Fraction(case.scene.duration)
    program = not case.rule.runs_at(50)
    coarser = 1 if (case.order or 0) <= 2 else 4 if case.order == 4 else 8
    if case.digits > 16:
        rung = duration / PART, 8 if (case.order or 0) > HIGH else 128
    elif program:
        # without more digits: a short time and coarse steps, so that less round-off adds up; but
        # what single steps do not show, a run that need not be its steps may do late
        quarters = 1 if case.rule.repeats else 4
        coarser = 8 if (case.order or 0) <= 2 else 32
        steps = quarters * case.scene.steps_for(case.scene.step) // coarser
        rung = duration * quarters / 4, max(8, steps)
    else:
        rung = duration, max(4, case.scene.steps_for(case.scene.step) // coarser)
    if case.steps:
        rung = rung[0], case.steps
    elif not program:
        rung = single_steps.resolved(case, *rung)
    duration, first = rung
    if program:  # each rung has a whole number of parts, and more than the one before
        return Ladder(duration, partial(_in_parts, first), PROGRAM_RUNGS, MOST_PROGRAM_RUNGS)
    double = case.digits == 16
    return Ladder(duration, lambda k: first * 2**k, RUNGS[double], MOST_RUNGS[double])


def _in_parts(first: int, rung: int) -> int:
    """Return the steps of a rung, a factor √2 apart, as a multiple of the times to be checked."""
    parts = 0
    for k in range(rung + 1):
        parts = max(parts + 1, round(first * 2 ** (k / 2) / CHECKED))
    return parts * CHECKED


def measure(case: Case, progress: Progress = silent) -> Found:
    """Return the runs of a ladder with their errors, and the order of these.

    error = ‖(x, μ) − (x̂, μ̂)‖₂ / ‖(x̂, μ̂)‖₂ at the same time T (for a program the mean of four
    times up to T). Under constraints, with more than 16 digits (in 16 a multiplier is known to
    round-off over h, for impulses are a step's part of it), also multipliers, the same of λ
    (`mean_multipliers`; None if its step back fails), and its order in `measured`. With 16 digits,
    if runs have no order, also round_off.
    """
    if case.rule.is_recorded:
        return recorded.measure(case)
    system = system_of(case)
    _ = case.scheme  # errors of scene or rule are reported before parts of it are derived
    progress(f"{case.scene.name} {case.label}: reference", 0.0)
    made = ladder(case, system)
    duration, rungs, most = made.duration, made.rungs, made.most
    program = not case.rule.runs_at(50)
    ends = CHECKED if program else 1
    times = [duration * (k + 1) / ends for k in range(ends)]
    wanted = [system.end(t, max(30, case.digits + 5)) for t in times]
    exact = wanted[-1]
    certain = exact.certain
    known = case.digits > 16 and exact.answer is not None and case.scene.all_constraints
    forces = reference.multipliers(case.scene, exact.answer) if known else None
    sizes = reference.multiplier_sizes(case.scene, exact.answer) if known else ()
    rows: list[Row] = []
    before: End | None = None  # if no other method knows the end, the end of the run before
    for i in range(most):
        # continue only while the asymptotic window has not been reached, and still may be
        if program and i >= FEWEST and sunk(case, rows, certain):
            break
        early = program and _early(case, rows, certain)
        if (
            i >= rungs
            and not early
            and decided(case, rows, certain)
            and multipliers.decided(case, rows, certain)
        ):
            break
        steps = made.steps(i)
        progress(f"{case.scene.name} {case.label}: {steps} steps", i / most)
        step = duration / steps
        row = Row(steps, float(step))
        try:
            flow = system.flow(step)
            run = flow.trajectory(steps, every=steps // ends)
        except StepFailure as failure:
            rows.append(replace(row, why_not="failed", cause=failure.cause))
            continue
        if exact.x is None:
            here = End(run.x[-1], run.mu[-1], certain)
            if before is not None:
                rows[-1] = rows[-1].with_errors(*system.error(before.x, before.mu, here))
            before = here
            rows.append(row)
            continue
        with mpmath.workdps(case.digits + 15):
            errors = [system.error(x, mu, at) for x, mu, at in
                      zip(run.x[1:], run.mu[1:], wanted, strict=True)]  # fmt: skip
            row = row.with_errors(*map(_mean, zip(*errors, strict=True)))
            if forces and any(sizes):
                try:
                    row = replace(row, multipliers=multipliers.error(flow, run, forces, sizes))
                except CannotMeasure:  # its adjoint meets no constraints, so only (x, μ) is judged
                    forces = None
        rows.append(row)
    if exact.x is None:
        rows.pop()  # the finest run is compared with no finer one
    rows, measured = fit(case, rows, certain)
    if case.digits == 16 and exact.answer is not None and case.rule.runs_at(50):
        if measured.order is None:
            if above_floor(case, rows, certain):
                rows = measure_round_off(case, rows, duration, exact.answer)
        elif single_steps.below(case, measured.order):
            grown = (single_steps.amplified(case, duration, row.steps) or 0.0 for row in rows)
            rows = [replace(row, round_off=off) for row, off in zip(rows, grown, strict=True)]
        rows, measured = fit(case, rows, certain)
    if forces:
        found_slope = slope_of_multipliers(case, rows, certain)
        slope = math.nan if found_slope is None else found_slope
        measured = replace(measured, multipliers=slope)
    progress(f"{case.scene.name} {case.label}: one step", 1.0)
    local = single_steps.measured(case, measured.order)
    measured = replace(measured, **exact.about)
    later = float(case.scene.duration) if duration < case.scene.duration else None
    found = Found(rows, measured, certain, exact.agreed, local, float(duration), whole=later)
    if found.trusted == certain:
        return found
    rows, again = fit(case, rows, found.trusted)
    return replace(found, rows=rows, measured=replace(again, **exact.about))


def _early(case: Case, rows: Sequence[Row], certain: float) -> bool:
    """True if errors are still so large that a slope beside the expected order decides nothing."""
    order, wanted = fit(case, rows, certain)[1].order, case.order
    last = rows[-1].error if rows else None
    if wanted is None or last is None:
        return False
    before = rows[-2].error if len(rows) > 1 else None
    sinking = before is not None and last < before * 2.0 ** (-wanted / 4)
    if order is not None and REACHED[True] < abs(order - wanted) < BESIDE_EARLY:
        return sinking and last > 100 * floor(case, certain)
    return (order is None or abs(order - wanted) > REACHED[True]) and last > LARGE and sinking


def _mean(errors: Any) -> float | None:
    known = [e for e in errors if e is not None]
    return math.sqrt(math.fsum(e * e for e in known) / len(known)) if known else None
