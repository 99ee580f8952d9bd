"""The effect of round-off on a run: on its end, and on conserved quantities, with separate tests.

The effect on a run's end depends on how the motion amplifies each rounding, which only the same run
with more digits shows (`measure_round_off`, for errors on a ladder of steps). This excuses every
effect of double precision, including a solver that ends too early.

A sound method conserves a momentum or an energy up to a walk of roundings, and a loose solver has
to fail: with more digits that solver would be sound, so the same run cannot excuse a drift. Instead
the maps F± alone are evaluated at given points, without a solver (`lost_one_way`): their loss, if
it is alike at each step, cannot be repaired by any solver.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators.errors import CannotMeasure, StepFailure
from discmech.integrators.flows import Flow
from discmech.integrators.numbers import arithmetic, mpmath

from ..core.case import Case
from ..systems.runs import gap

ROWS = 16  # number of tested steps of a run
#: factor of the shorter step at which F± are evaluated again
SHORTER = 64
#: digits of the comparison that shows the round-off of double precision
MORE_DIGITS = 34
#: steps of the longest run that is repeated so; the coarsest is always repeated
MOST_STEPS = 20_000


def unit(digits: int) -> float:
    """Return the unit of round-off of a precision."""
    return 2.0**-53 if digits == 16 else 10.0**-digits


def size(rows: np.ndarray) -> float:
    """Return the largest absolute entry, or 1 if all vanish."""
    return max(float(abs(e)) for e in rows.ravel()) or 1.0


def residuals(flow: Flow) -> tuple[float, float]:
    """Return how well the steps of a short run are solved, and how well they can be evaluated.

    Both are relative to ‖μ‖: the largest ‖F⁻(x, u)/h − μ‖ in the flow's own numbers, and its
    distance from F⁻ and F⁺ with more digits at the same points; for a composition those of its
    first substep.
    """
    run, first = flow.trajectory(ROWS), flow.parts[0]
    more = replace(first, numbers=arithmetic(flow.digits + 34))
    residual, noise, whole = 0.0, 0.0, size(run.mu)
    for x, u, mu in zip(run.base, run.u, run.mu, strict=True):
        maps = []
        for at in (first, more):
            with at.numbers.working():
                here = at.maps_at(*at.vectors(x, u))
                maps.append({k: at.numbers.public(here[k] / at.h) for k in ("minus", "plus")})
        residual = max(residual, float(max(abs(maps[0]["minus"] - mu))) / whole)
        off = [max(abs(float(a - b)) for a, b in zip(maps[1][k], maps[0][k], strict=True))
               for k in ("minus", "plus")]  # fmt: skip
        noise = max(noise, *(e / whole for e in off))
    return residual, noise


def measure_round_off(case: Case, rows: Sequence[Any], duration: Fraction, exact: Any) -> list[Any]:
    """Return rows with `round_off`: how far double precision moved a run's end, like errors.

    The same run with `MORE_DIGITS` shows it for every rule: a rule that takes differences of nearly
    equal numbers, such as (s − x)/h of a stage that is a position, has errors that grow as steps
    get shorter, and so does a motion that amplifies them. Runs with N > `MOST_STEPS` get the
    largest measured value times (N/N₀)², where N₀ is the largest measured number of steps: N steps,
    with round-off over h in each. Rows whose runs stop get none.
    """
    known, made = list[tuple[int, float]](), list(rows)
    for k, row in enumerate(rows):
        steps = row.steps
        if row.error is None:
            continue
        if known and steps > MOST_STEPS:
            most = max(steps for steps, _ in known)
            round_off = max(round_off for _, round_off in known) * (steps / most) ** 2
            made[k] = replace(row, round_off=round_off)
            continue
        try:
            ends = []
            for digits in (case.digits, MORE_DIGITS):
                run = case.scheme.flow(duration / steps, digits).trajectory(steps, every=steps)
                ends.append([*run.x[-1], *run.mu[-1]])
        except StepFailure:
            continue
        with mpmath.workdps(MORE_DIGITS + 15):
            off, _ = gap(*ends)
            _, whole = gap(ends[0], [*exact.x, *exact.mu])
            known.append((steps, float(off / (whole or 1))))
        made[k] = replace(row, round_off=known[-1][1])
    return made


def lost_one_way(case: Case, steps: int) -> float:
    """Return the sum of a systematic error of F⁻ and F⁺ over N steps, relative to ‖μ‖.

    It is 0 for plain rules. A rule that takes differences of nearly equal numbers, such as (s −
    x)/h of a stage that is a position, is off by round-off over h, alike from step to step, so the
    sum is not bounded by a walk. At a step `SHORTER` times as short it is off by that factor more,
    and a plain rule by as much as before; the threshold is the mean of both, in logarithms.
    (Measured on all scenes: 14 times and more, and 3 at most.)
    """
    if not case.rule.is_formula:
        return 0.0
    try:
        steps_of = (case.scheme.flow(Fraction(case.scene.step) / k, case.digits)
                    for k in (1, SHORTER))  # fmt: skip
        noise, finer = (residuals(flow)[1] for flow in steps_of)
    except (CannotMeasure, StepFailure):
        return 0.0
    return 2 * steps * noise if finer > math.sqrt(SHORTER) * noise else 0.0


def why_unknown(name: str, drift: float, lost: float) -> str:
    """Return the reason of an inconclusive verdict if `lost` may explain a drift."""
    return (
        f"{name} drifts by {drift:.2g}, and this rule's F± are so far from what more digits say "
        f"that round-off may add up to {lost:.1g}: look for differences of nearly equal numbers."
    )
