"""The constant step that reaches a tolerance: a pilot measures the error, the order scales it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from math import ceil, gcd, inf, log2
from typing import Any

import numpy as np

from ..errors import BadInput, StepFailure
from ..numbers import Matrix, exact_rational
from .run import Trajectory

ROWS = 8  # times at which runs are compared: errors pass through zero, but not everywhere at once
MOST, MOST_OF_DIGITS = 2**20, 2**12  # steps of a pilot, in double precision and with more digits
#: a pilot whose fixed point contracts at no step so far turns to Newton's method at this number of
#: steps, or at 1/2⁸ of the most that it may take: what is left then of the ladder is enough for it
CONTRACTS = 2**8
#: a smaller step is taken where it needs so many fewer sweeps in all. A step has costs beside its
#: sweeps, of which smaller ones have more: a tenth of the sweeps has to pay for them
FEWER = 0.9
SMALLER = (Fraction(3, 2), 2, 3, 4, 6, 8)  # times as many steps that are tried for fewer sweeps
SAFETY = 2.0  # the step aims at this part of the tolerance
ROUND_OFF = 16  # units that no tolerance may be below: runs that agree may share their round-off


@dataclass(frozen=True)
class StepChoice:
    """A step that was chosen for a tolerance.

    step: duration/steps, exact. error: from the largest difference to the pilot's finest run, of
    twice as many steps or more, at ROWS equal times of the scene's duration (at the four they share
    if there are 12 steps), of each component of (x, μ) by its own largest value there. order: with
    which the error was scaled, the scheme's (at most 2 with contact), or measured where it states
    none; constant: error/step^order.
    """

    tolerance: float
    step: Fraction
    steps: int
    error: float
    order: float
    constant: float

    def __str__(self) -> str:
        return (
            f"step {float(self.step):.6g}, {self.steps} steps of the scene's duration, for a "
            f"tolerance of {self.tolerance:g}: error {self.error:.1e} at order {self.order:.3g}"
        )


def step_for(scheme: Any, tolerance: Any, flow: Callable[[Fraction], Any]) -> StepChoice:
    """The cheapest step found whose error over the scene's duration is within the tolerance.

    Of the steps at which the fixed point of the stages contracts (of all, if it contracts at none)
    it is the largest. A part of it, down to an eighth (`SMALLER`), is taken instead where a run
    with that needs fewer sweeps in all.
    flow: step ↦ flow. Numbers of steps are doubled until the error, which runs with h and h/2
    show, is within the tolerance; the scheme's order then says what the tolerance needs, and a run
    with that many steps is compared with the best one. Raises `BadInput` for a tolerance that is
    not positive, and for one that no step of the pilot reaches, with the smallest that one does.
    """
    scene, stated = scheme.scene, scheme.order or 0
    if scene.contact is not None:
        stated = min(stated, 2)  # of what stays closed, whatever the rule
    wanted = float(exact_rational(tolerance, "tolerance"))
    if not 0 < wanted < 1:
        raise BadInput(f"tolerance is {tolerance!r}: give a number between 0 and 1.")
    whole = flow(scene.duration)
    numbers = whole.numbers
    most = MOST if numbers.digits == 16 else MOST_OF_DIGITS
    aim = max(wanted, ROUND_OFF * float(numbers.eps))
    failed: list[StepFailure] = []
    # the fixed point goes without Newton's method, for which nothing is compiled
    alone = scene.contact is None and whole.stages is not None

    @cache
    def rows_and_sweeps(steps: int) -> tuple[Matrix | None, float]:
        """The rows of a run, if it has an end; the sweeps of all its steps by fixed point, if so
        they were made."""
        pilot = flow(scene.duration / steps)
        if alone:
            pilot.stages.alone = True
        try:
            run: Trajectory = pilot.trajectory(steps, steps // gcd(steps, ROWS))
        except StepFailure as failure:
            failed.append(failure)
            return None, inf
        table = np.concatenate([run.x, run.mu], axis=1)
        if not (abs(table) < inf).all():
            return None, inf
        return table, run.newton_mean * (steps + 1) if alone else 0.0

    def error(steps: int, best: int) -> float:
        (one, _), (other, _) = rows_and_sweeps(steps), rows_and_sweeps(best)
        if one is None or other is None:
            return inf
        shared = gcd(len(one) - 1, len(other) - 1)  # times of both
        one, other = (rows[:: (len(rows) - 1) // shared] for rows in (one, other))
        sizes = abs(other).max(axis=0)
        off = (abs(one - other) / np.where(sizes == 0, 1, sizes)).max()
        return float(off) / (1 - (steps / best) ** (stated or 1))

    steps, errors, floor = ROWS, dict[int, float](), 0
    while (found := error(steps, 2 * steps)) > aim:
        # round-off: what was small and fell with the order does not fall any more, twice
        before = errors.get(steps // 2, inf)
        floor = floor + 1 if found > before / 2 and before < 1e-6 else 0
        errors[steps] = found
        if alone and steps >= max(CONTRACTS, most // CONTRACTS) and min(errors.values()) == inf:
            steps, alone = ROWS, False
            errors.clear()
            rows_and_sweeps.cache_clear()
            continue
        if floor == 2 or 4 * steps > most:
            raise _unreachable(scheme, wanted, errors, most, failed)
        steps *= 2
    errors[steps] = found
    if wanted < aim:
        raise _unreachable(scheme, wanted, {steps: aim}, most, failed)
    best = 2 * steps
    coarse = errors.get(steps // 2, inf)
    order = stated
    if not order and coarse < inf:
        order = max(1.0, log2(coarse / max(found, wanted * 1e-3)))
    if coarse < inf and order:
        less = ceil(steps / 2 * (SAFETY * coarse / wanted) ** (1 / order) / ROWS) * ROWS
        if less < steps and (between := error(less, best)) <= wanted:
            steps, found = less, between
    fewer = steps
    for more in (int(steps * factor) for factor in SMALLER):
        if not rows_and_sweeps(more)[1] < FEWER * rows_and_sweeps(fewer)[1]:
            break
        fewer = more
    if fewer > steps and (between := error(fewer, 2 * fewer)) <= wanted:
        steps, found = fewer, between
    step = scene.duration / steps
    return StepChoice(wanted, step, steps, found, order, found / float(step) ** order)


def _unreachable(
    scheme: Any, wanted: float, errors: dict[int, float], most: int, failed: list[StepFailure]
) -> BadInput:
    """The error for a tolerance that no step of the pilot reaches."""
    steps, least = min(errors.items(), key=lambda pair: pair[1])
    what = f"{scheme.scene.name} with {scheme.rule.name}: a tolerance of {wanted:g}"
    if least == inf:
        why = f"; the last failure: {failed[-1]}" if failed else ""
        return BadInput(f"{what} is not reached: no pilot of up to {most} steps has an end{why}.")
    return BadInput(
        f"{what} is below round-off, or takes more than {most // 2} steps; the smallest that "
        f"is reached: {least * 1.03:.1e}, with {steps} steps."
    )
