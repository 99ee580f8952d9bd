"""The form along one long run of a program, by closed curves of starts that are followed by rows.

A fault may begin after many steps, or lie where no drawn place is. The map from the start to each
row keeps the form if a step does, so all rows of the same runs are judged.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators import StepFailure
from discmech.integrators.extensions.foreign import MapOfRows, guarded, images
from discmech.integrators.numbers import Matrix, Vector

from ..core.case import Case, Progress
from ..evidence.cloud import in_box
from ..evidence.late import keeps_something
from ..evidence.places import random_fraction, seed_in_numbers
from ..evidence.repeated import repeated
from . import in_numbers
from .form_in_numbers import random_curve
from .in_numbers import curve_defect, free_states, may_hide
from .judging_form import is_defect
from .places import map_of, scale_of
from .records import Defect, FoundOfNumbers, OfRun

#: steps of all runs together, for a step that asks the scene so often, less work than the energy's
#: long run; of programs with longer ones more, in proportion. A map of many states makes one call
CALLS, ASKS, USUAL = 2**15, 4, 10**5
MOST, LEAST = 2**11, 2**5  # steps of a run
POINTS = 32  # of a curve
ROWS = 16  # rows of a run at which its curve is looked at
LEGS = 16  # runs after one another, each from where the form was last resolved
LATE = 2**13  # steps of a map that keeps something which are made again
SHORTER = 4  # factor of the next length if no row of a run is resolved
#: sizes of a curve in parts of the motion; a smaller one is for runs that draw it out too far
REACHES = (0.02, 1e-3, 5e-5)
STARTS = 64  # drawn states of a map's box, of which that with the longest run in it is taken
STEP = 0.7, 1.0  # shares of the scene's step from which the run's is drawn


def measure(case: Case, progress: Progress) -> FoundOfNumbers:
    """Return the steps from drawn places (`in_numbers`), and the form along a run.

    Where one step loses the form already, only a short run is made, to see if it is its steps.
    """
    record = in_numbers.measure(case, progress)
    if record.measured.certain is None:
        return record
    rule: Any = case.rule
    scale, seed = scale_of(case.scheme), seed_in_numbers(case.scheme)
    if not is_defect(record.measured.certain, rule.unit(16)):
        progress(f"{case.scene.name} {case.label}: a long run", 1.0)
        run = _of_run(case, scale, seed)
    elif rule.repeats:
        flow, z = _start(case, seed)
        run = OfRun(float(flow.step), again=repeated(flow, z, scale, LEAST).gap)
    else:
        return record
    residual = max(record.measured.residual or 0.0, run.again)
    return replace(record, measured=replace(record.measured, residual=residual), run=run)


def _of_run(case: Case, scale: Vector, seed: int) -> OfRun:
    """Return the first certain defect of the form along a run, and how far the form is seen.

    A motion that draws closed curves out, as near a saddle, is covered by runs after one another,
    of a program that makes the same steps from whatever state it starts.
    """
    scheme: Any = case.scheme
    flow, z = _start(case, seed)
    _, reach = free_states(case, flow.system, z, scale)
    curves = 1 if len(reach) == 2 else 2  # of two numbers the form has one entry
    calls = curves * (1 if scheme.rule.vectorised else POINTS)
    work = calls * max(ASKS, flow.questions()) * USUAL
    steps = CALLS * ASKS * scheme.rule.long_run // work // ROWS * ROWS
    steps = whole = min(MOST, max(LEAST, steps))
    z, stays = _longest(scheme, flow, z, steps, seed) if in_box(scheme) else (z, steps)
    if (steps := stays // ROWS * ROWS) == 0:
        return OfRun(float(flow.step), left=stays)
    own = scheme.rule.follows_motion
    wanted = min(steps, case.scene.steps_for(flow.step)) if own else 0
    drawn, unit = np.random.default_rng(seed + 4), scheme.rule.unit(16)
    of_run = OfRun(float(flow.step), steps, wanted, left=stays if stays < whole else 0)
    at, length, legs = z, steps, LEGS if scheme.rule.repeats else 1
    while legs:
        before, part = of_run.covered, length // ROWS
        run = guarded(map_of(flow, length, before * flow.step, ROWS), ROWS * len(z))
        where = flow.system, run, at, scale, *free_states(case, flow.system, at, scale), drawn
        of = zip(*(_of_curve(case, *where) for _ in range(curves)), strict=True)
        rows = [_worse(*each) if len(each) > 1 else each[0] for each in of]
        told = [k for k, row in enumerate(rows, 1) if row.resolution <= may_hide(case)]
        seen = part * max(told, default=0)
        of_run = replace(of_run, seen=max(of_run.seen, seen), covered=before + seen)
        broken = [k for k, row in enumerate(rows, 1) if is_defect(row.certain, unit, part * k)]
        if broken:
            k = broken[0]
            of_run = replace(of_run, broken=before + part * k, certain=rows[k - 1].certain)
        if broken or of_run.covered >= wanted:
            break
        if seen:
            at, legs = np.asarray(run(at)).reshape(ROWS, -1)[max(told) - 1], legs - 1
        elif length < SHORTER * ROWS:
            break
        else:  # its first row is where the curve is drawn out too far already
            length = length // SHORTER // ROWS * ROWS
    # single steps of what has a motion are made again by the evidence
    counts = not own and keeps_something(scheme, *np.split(z, [flow.system.n]))
    again = [repeated(flow, z, scale, steps, seed=seed).gap
             for _ in range(-(-LATE // steps) if counts else 1)]  # fmt: skip
    return replace(of_run, again=max(again))


def _longest(scheme: Any, flow: Any, z: Vector, steps: int, seed: int) -> tuple[Vector, int]:
    """Return (the start in a map's box from which a run stays in it, its steps), z if it does.

    Of some drawn starts it is the one from which the run is longest, at most of so many steps.
    """
    low, high = np.array(scheme.rule.states, dtype=float)
    drawn, step, best = np.random.default_rng(seed), map_of(flow, 1), (z, 0)
    for _ in range(STARTS):
        at, made = z, 0
        with suppress(StepFailure):
            while made < steps and np.isfinite(at := step(at)).all():
                made += 1
        best = max(best, (z, made), key=lambda each: each[1])
        if made == steps:
            break
        z = drawn.uniform(low, high)
    return best


def _start(case: Case, seed: int) -> tuple[Any, Vector]:
    """Return the flow of a drawn step, of a map its own one, and the scene's start."""
    scheme: Any = case.scheme
    share = random_fraction(random.Random(seed + 4), *STEP)
    flow = scheme.flow(scheme.rule.step_for(Fraction(scheme.scene.step) * share))
    start = flow.trajectory(0)
    return flow, np.concatenate([start.x[0], start.mu[0]]).astype(float)


def _worse(a: Defect, b: Defect) -> Defect:
    """Return what two curves tell together: the larger defect, and the poorer resolution."""
    return Defect(max(a.certain, b.certain), max(a.measured, b.measured),
                  max(a.resolution, b.resolution))  # fmt: skip


def _of_curve(
    case: Case, system: Any, run: Any, z: Vector, scale: Vector, embed: Any, reach: Vector,
    drawn: np.random.Generator,
) -> Sequence[Defect]:  # fmt: skip
    """Return the defect at each row over a closed curve; over a smaller one where it is better."""
    best = [Defect(0.0, 0.0, np.inf)] * ROWS
    for share in REACHES:
        curve = np.array([embed(y) for y in random_curve(drawn, 0 * reach, reach, share, POINTS)])
        maps = _by_row(run, len(z))
        defects = [curve_defect(case, system, f, z, scale, curve) for f in maps]
        best = [min(pair, key=lambda each: each.resolution)
                for pair in zip(best, defects, strict=True)]  # fmt: skip
        if best[-1].resolution <= may_hide(case) or any(of.certain for of in best):
            break
    return best


def _by_row(run: Any, size: int) -> list[MapOfRows]:
    """Return the maps to each row of the runs, which are made once for all of them."""
    made: dict[bytes, Matrix] = {}

    def all_rows(points: Matrix) -> Matrix:
        key = points.tobytes()
        if key not in made:
            made[key] = images(run, points)
        return made[key]

    def to_row(part: slice) -> MapOfRows:
        return MapOfRows(lambda z: all_rows(z[None])[0, part], lambda zs: all_rows(zs)[:, part])

    return [to_row(slice(k * size, (k + 1) * size)) for k in range(ROWS)]
