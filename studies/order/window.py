"""The asymptotic window of errors on a ladder of steps, and the meaning of errors beside a line."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.case import Case
from ..core.fitting import (
    BENT,
    Window,
    asymptotic_window,
    bent_below,
    line_of,
    marks,
    orders_between,
)
from ..core.outcome import GOING_AWAY, NOT_CONVERGING
from ..evidence.powers import beside_sum
from .records import Found, Measured, Row

#: in double precision or not: a ladder ends when its order is so near to the expected one
REACHED = {True: 0.05, False: 0.01}
STRAIGHT = {True: 0.012, False: 0.005}  # largest distance of logarithms of errors from their line
NOWHERE = 1e-2  # relative error at the finest step of a run that does not converge
AWAY = 0.1  # distance of a local order that is not the expected one
TINY = 1e-9  # relative error that no method has with steps that are too long for the motion
TOO_LONG = 0.1  # relative error that any method may have with steps that are too long
LEAST_POINTS = 4  # fewest points of a line
MORE_POWERS, SPARE = 2, 3  # powers of a sum beside its first one, and fewest errors beyond them


def floor(case: Case, certain: float) -> float:
    """Return a run's round-off, some √N units in N steps; smaller errors are not the method's."""
    least = 32 * case.rule.unit(16) if case.digits == 16 else 10.0 ** (3 - case.digits)
    return max(least, 10.0 ** (2 - certain))


def decided(case: Case, rows: Sequence[Row], certain: float) -> bool:
    """True if smaller steps would change nothing."""
    rows, measured = fit(case, rows, certain)
    order = measured.order
    if order is None:
        return only_round_off(rows) or bool(departure(case, rows, certain))
    near = REACHED[case.digits == 16]
    if case.order is None or abs(order - case.order) <= near:
        return True
    if too_few(case, rows, certain):
        return False
    share = hidden_share(case, rows, certain, order)
    return share is None or share <= near or (case.digits == 16 and sunk(case, rows, certain))


def only_round_off(rows: Sequence[Row]) -> bool:
    """True if the last three halvings of the step did not halve small errors.

    Round-off does not sink with the step, so no further rung helps; errors that are not small may
    come from steps that are too long.
    """
    last = [row.error for row in rows[-4:] if row.error is not None]
    if len(last) < 4 or max(last) > TINY:
        return False
    return all(b > a / 2 for a, b in itertools.pairwise(last))


def sunk(case: Case, rows: Sequence[Row], certain: float) -> bool:
    """True if the last errors are at round-off, below which no smaller step leads."""
    last = [row.error for row in rows[-2:]]
    return all(e is not None and e <= 10 * floor(case, certain) for e in last)


def above_floor(case: Case, rows: Sequence[Row], certain: float) -> bool:
    """True if enough errors are above the floor to fit a line."""
    return len(_clear(case, rows, certain)) >= LEAST_POINTS


def _clear(case: Case, rows: Sequence[Row], certain: float) -> list[Row]:
    least = floor(case, certain)
    return [row for row in rows if row.error is not None and row.error > least]


def too_few(case: Case, rows: Sequence[Row], certain: float) -> bool:
    """True if errors are too few for `hidden_share`, and the local orders come nearer to the
    expected one at each smaller step."""
    missed = [abs(p - (case.order or 0)) for p in _local_orders([row for row in rows if row.used])]
    nearer = len(missed) > 1 and missed == sorted(missed, reverse=True)
    few = len(_clear(case, rows, certain)) < MORE_POWERS + 1 + SPARE
    return few and nearer and missed[-1] < 0.75 * missed[0]


def hidden_share(case: Case, rows: Sequence[Row], certain: float, slope: float) -> float | None:
    """Return by which share a lower power may change the finest error, if the expected order is
    reached.

    A method of order p has errors hᵖ(c₀ + c₁h + c₂h² + …), of which a line has the slope p only
    where c₁h is small; a lower power adds b hᵖ⁻¹. Three terms are fitted, with the weight of what a
    line leaves (`STRAIGHT`) and of a run's round-off, which N steps make √N times that of one. If
    they leave r of this, at most, and a lower power that is all of the finest error would leave s
    beside them, then r is too little for one of more than r/s of that error, since what is left is
    linear in the errors. (Such a power moves the local order by its share, so the tolerance of an
    order is that of the share.) In the same way c₀hᵖ is there if it is more than r over what it
    would leave beside the other two. Of all windows that end at the finest error above round-off
    and hold the line's points the least r/s counts: each of them bounds the same power. Those of x
    and of μ alone count as well, since a fault of one hides under the error of the other. None if
    none is explained, r ≤ 1, with a first term, or if below p a lower power may be half of the
    error: then the line tells the order.
    """
    clear, least = _clear(case, rows, certain), floor(case, certain)
    if not case.order or not clear:
        return None
    best = _share(case, clear, [row.error or 0.0 for row in clear], certain)
    if not (best < 0.5 or (case.order < slope and best < math.inf)):
        return None
    for part in ("error_x", "error_mu"):
        known = {row: e for row in clear if (e := getattr(row, part) or 0.0) > least}
        of_part = _share(case, [*known], [*known.values()], certain, of_part=True)
        best = max(best, of_part if of_part < math.inf else 0.0)
    return best


def _share(
    case: Case, clear: Sequence[Row], errors: Sequence[float], certain: float, of_part: bool = False
) -> float:
    """Return the least r/s of `hidden_share` for these errors, infinite if nothing explains them.

    of_part: they are those of x or of μ alone, which may be of a higher order.
    """
    order, least, best = case.order or 1, floor(case, certain), math.inf
    steps, sizes = np.array([abs(row.step) for row in clear]), np.array(errors)
    weight = (2 ** STRAIGHT[case.digits == 16] - 1) * sizes
    weight += least * np.sqrt([row.steps for row in clear])
    own = range(order, order + MORE_POWERS + 1)
    lines = [k for k, row in enumerate(clear) if row.used]
    for first in range(1 + min([len(clear) - len(own) - SPARE, *lines[:1]])):
        x, wide = steps[first:] / steps[-1], weight[first:] / sizes[-1]
        rests, constant = beside_sum(x, sizes[first:] / sizes[-1], wide, own)
        left = np.abs(rests).max()
        of_first, of_lower = (
            np.abs(beside_sum(x, x**power, wide, others)[0]).max()
            for power, others in ((order, own[1:]), (order - 1, own))
        )
        if left <= (1 if of_part else min(1, constant * of_first)):
            best = min(best, float(left / of_lower))
    return best


def _local_orders(rows: Sequence[Row]) -> list[float]:
    known = [(row.step, row.error) for row in rows if row.error is not None]
    return orders_between(*zip(*known, strict=True)) if known else []


def departure(case: Case, rows: Sequence[Row], certain: float) -> tuple[str, str] | None:
    """Return why errors beside a straight line cannot be those of the expected order, as a word of
    `core.outcome` and a sentence; None if they can.

    Local orders of a method of order p approach p at ever smaller steps. Three that miss it and go
    away, or agree with each other, belong to another order; so do errors that no step reduced.
    """
    order = case.order
    bent = BENT * floor(case, certain)
    clear = [row for row in rows if row.error is not None
             and row.error > bent and not is_bent(case, row)]  # fmt: skip
    if order is None or len(clear) < 4:
        return None
    if stuck := not_converging([(row.step, row.error) for row in clear], order):
        return NOT_CONVERGING, f"the runs {stuck}"
    local = _local_orders(clear[-4:])
    missed = [abs(p - order) for p in local]
    one_side = len({p > order for p in local}) == 1  # round-off goes to both sides
    away = one_side and missed[0] <= missed[1] <= missed[2]
    settled = max(local) - min(local) < min(missed) / 4
    if min(missed) > AWAY and (away or settled):
        return GOING_AWAY if away else "", (
            f"the local order {'goes away from' if away else 'settles beside'} the expected "
            f"{order}: {', '.join(f'{p:.2f}' for p in local)} at the finest steps."
        )
    return None


def clear_rows(case: Case, record: Found) -> list[Row]:
    """Return the runs with errors above round-off."""
    bent = BENT * floor(case, record.certain)
    return [row for row in record.rows if row.error is not None and row.error > bent]


def clear_orders(case: Case, record: Found) -> list[float]:
    """Return the local orders of runs with errors above round-off, those of the finest steps
    last."""
    return _local_orders(clear_rows(case, record))


def is_bent(case: Case, row: Row) -> bool:
    """True if measured round-off changes log₂ of the error by more than a line may be off."""
    known = row.round_off or 0.0
    return row.error is not None and row.error <= bent_below(known, STRAIGHT[case.digits == 16])


def not_converging(errors: Sequence[tuple[float, float | None]], order: float) -> str:
    """Return a sentence on errors (step, error) that do not sink, of two or more; "" if none."""
    known = [(step, error) for step, error in errors if error is not None]
    if len(known) < 2 or known[-1][1] <= NOWHERE:
        return ""
    (longest, first), (shortest, last) = known[0], known[-1]
    halvings = math.log2(longest / shortest)
    if first >= last * 2 ** (order / 2 * halvings):
        return ""
    # two runs that agree to the same hundredth as `NOWHERE` have converged, and not to the motion
    settled = abs(known[-2][1] - last) <= NOWHERE * last
    said = "converge, to another motion" if settled else "do not converge"
    return (
        f"{said}: {halvings:.0f} halvings of the step leave an error of "
        f"{last:.2g}, where order {order} is expected."
    )


def fit(case: Case, rows: Sequence[Row], certain: float) -> tuple[list[Row], Measured]:
    """Find the asymptotic window; note for every other point why it is left out."""
    errors, least = [row.error for row in rows], floor(case, certain)
    window = _window(case, rows, errors, certain, [row.round_off or 0.0 for row in rows])
    made = zip(rows, marks(errors, window, least), strict=True)
    return [replace(row, **mark) for row, mark in made], Measured(**line_of(window))


def off_the_line(rows: Sequence[Row], order: float) -> Row | None:
    """Return a run beside a line of four and more with an error that is not the method's, or None.

    Errors on the line are within `STRAIGHT` of it. What is left of them grows, relative to the
    line, as another power of the step towards longer steps, and as round-off towards shorter ones:
    by h⁴, and by N² h^-order, N the number of steps. So a run that is farther off, though its step
    is only a little longer or shorter, is another method's; errors of a tenth of the motion and
    more tell nothing.
    """
    used = [row for row in rows if row.used]
    if len(used) < LEAST_POINTS:
        return None
    steps, errors = np.log2([(row.step, row.error or math.nan) for row in used]).T
    line = np.polyfit(steps, errors, 1)
    for row in rows:
        if row.used or row.error is None:
            continue
        wanted = 2 ** np.polyval(line, math.log2(row.step))
        if row.step > used[0].step and row.error >= TOO_LONG:
            continue
        longer, shorter = row.step / used[0].step, used[-1].step / row.step
        grown = longer**4 if longer > 1 else shorter ** (2 + order)
        if abs(row.error / wanted - 1) > 2 * (2 ** STRAIGHT[True] - 1) * grown:
            return row
    return None


def off_its_neighbours(rows: Sequence[Row], order: float) -> Row | None:
    """Return a run whose error is beside the order of the four runs next to it, or None.

    What another power of the step adds to log₂ of the errors grows with the step. So it moves a run
    off the line between the two beside it by at most as much as it differs between these: by the
    distance of their local order from the expected one, times that of log₂ of their steps. They are
    next to each other among the others, so a run that is off by more than the largest such
    distance times theirs is another method's, or follows another motion.
    """
    known = [row for row in rows if row.error]
    steps, errors = np.log2([(row.step, row.error or math.nan) for row in known]).T.reshape(2, -1)
    for k in range(1, len(known) - 1):
        others = sorted(sorted(set(range(len(known))) - {k}, key=lambda j: abs(j - k))[:4])
        missed = np.abs(np.diff(errors[others]) / np.diff(steps[others]) - order).max()
        share = (steps[k] - steps[k - 1]) / (steps[k + 1] - steps[k - 1])
        off = abs(errors[k] - (1 - share) * errors[k - 1] - share * errors[k + 1])
        bent = missed * abs(steps[k + 1] - steps[k - 1])
        if len(others) == LEAST_POINTS and off > max(2 * STRAIGHT[True], bent):
            return known[k]
    return None


def slope_of_multipliers(case: Case, rows: Sequence[Row], certain: float) -> float | None:
    """Return the slope of the errors of multipliers in their asymptotic window, or None."""
    window = _window(case, rows, [row.multipliers for row in rows], certain)
    return None if window is None else window.line.slope


def _window(
    case: Case, rows: Sequence[Row], errors: Sequence[float | None], certain: float,
    known: Sequence[float] | None = None,
) -> Window | None:  # fmt: skip
    numbers = [math.nan if error is None else error for error in errors]
    straight = STRAIGHT[case.digits == 16]
    steps = [row.step for row in rows]
    return asymptotic_window(steps, numbers, floor(case, certain), straight, known)
