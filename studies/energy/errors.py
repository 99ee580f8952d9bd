"""The error of the energy along runs: its band, its slope, its edges, and drifts inside it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from discmech.integrators.flows import Trajectory

from ..core.case import Case
from ..core.fitting import BATCHES, Line, batch_line, fit_line, steadiness
from ..systems.runs import bins
from .judging_errors import came_back, goes_steadily, has_edges, is_rise
from .records import Found, Measured, Row

ROWS = 2000
STRETCH = 4096  # rows that are examined before the next
LONGER = (1, 8, 32)  # factors of the steps, until the verdict is clear
PARTS = 8  # a drift moves the means of so many parts of the run one way
ErrorsOf = Callable[[int], tuple[np.ndarray, np.ndarray]]
CERTAIN = 0.999  # level of the intervals of mean and edges, which must not contain 0 in a drift
#: parts of a drift's run, in eighths of `BATCHES`. If a whole number of periods is nearly a part of
#: the run, means of the parts rise slowly and steadily without a drift (aliasing): where the run is
#: so many periods to within a quarter, one in 16 with 8 parts, one in 1000 with 7, 8 and 9
PARTITIONS = (8, 7, 9)


def measured_errors(
    case: Case, errors_of: ErrorsOf, is_enough: Callable[[float, float], bool] | None = None
) -> Found:
    """Return `measure` for a function that gives (times, errors) of a run that is so many times as
    long.

    is_enough: (band, duration) ↦ True if no longer run is needed.
    """
    drifts: list[list[float]] = []
    for more in LONGER[:1] if case.rule.is_recorded else LONGER:
        times, errors = errors_of(more)
        band, duration = float(np.ptp(errors)), float(times[-1])
        line, edges = fit_line(times, errors), _edge_slopes(times, errors)
        drift = certain_drift(case, times, errors)
        if drift is not None:
            drifts.append([duration, drift.slope, *drift.interval])
        if is_enough is not None and is_enough(band, duration):
            break
        inside = has_edges(case.rule.unit(case.digits), band, line.slope, duration, edges)
        if inside and drift is not None and len(drifts) == 1 and more < LONGER[-1]:
            continue
        if inside or goes_steadily(_steadiness(errors)):
            break  # a drift goes one way, and a longer run would only repeat it
    rows = []
    for first, last in bins(len(times), ROWS // 2):
        part = errors[first:last]
        ends = sorted({first + int(part.argmin()), first + int(part.argmax())})
        rows += [Row(float(times[i]), float(errors[i])) for i in ends]
    measured = Measured(band, line.slope, _interval(line, times, errors), edges)
    quarters = [float(np.ptp(errors[a:b])) for a, b in bins(len(errors), 4)]
    return Found(rows, measured, _steadiness(errors), quarters, drifts, duration)


def _interval(line: Line, times: np.ndarray, errors: np.ndarray) -> list[float]:
    """Return the slope's 95 % interval, as wide as that of the line through batch means."""
    if not np.isfinite(errors).all():
        return list(line.interval)
    low, high = batch_line(times, errors).interval
    half = max((high - low) / 2, abs(line.slope - (low + high) / 2))
    return [line.slope - half, line.slope + half]


def certain_drift(case: Case, times: np.ndarray, errors: np.ndarray) -> Line | None:
    """Return the line through the means of the run's parts, if its slope cannot be random, or None.

    Mean, minima and maxima of the parts go the same way, each with an interval without 0, and
    steadily, for every division of the run (`PARTITIONS`); and it is more than round-off.
    """
    if len(errors) < 256 or not np.isfinite(errors).all():
        return None
    if not goes_steadily(_steadiness(errors)):
        return None
    mean, *others = (
        batch_line(times, errors, CERTAIN, of, [count * k // 8 for count in BATCHES])
        for k in PARTITIONS for of in (np.mean, np.min, np.max)
    )  # fmt: skip
    ends = [end * np.sign(mean.slope) for line in (mean, *others) for end in line.interval]
    rise = float(abs(mean.slope) * times[-1])
    return mean if min(ends) > 0 and is_rise(case.rule.unit(case.digits), rise) else None


def _steadiness(errors: np.ndarray) -> float:
    """Return the distance of the parts' means over the length of their way: 1 if monotonic.

    A drift goes one way, even where it slows down; a band that wanders, as in chaotic motion, goes
    to and fro.
    """
    return steadiness(np.array([errors[a:b].mean() for a, b in bins(len(errors), PARTS)]))


def _edge_slopes(times: np.ndarray, errors: np.ndarray) -> list[float] | None:
    """Return slopes of the lines through the minima and the maxima of the parts, per unit of time.

    A secular drift c t moves the extremes of every part along by c t, and the mean in between may
    wander: steady edges rule a drift out.
    """
    parts = bins(len(errors), PARTS)
    if len(parts) < PARTS or not np.isfinite(errors).all():
        return None
    middles = [times[a:b].mean() for a, b in parts]
    extremes = [[errors[a:b].min(), errors[a:b].max()] for a, b in parts]
    return [float(slope) for slope in np.polyfit(middles, extremes, 1)[0]]


def turns_of(run: Trajectory) -> int:
    """Return how often the coordinate that turns most often turns, until that is often enough."""
    parts = [np.asarray(part) for part in (run.x, run.mu)]
    counts = np.zeros(sum(part.shape[1] for part in parts), dtype=int)
    for first in range(0, len(parts[1]) - 2, STRETCH):  # the first stretch is mostly enough
        rows = slice(first, first + STRETCH + 2)
        ways = np.sign(np.diff(np.hstack([part[rows] for part in parts]).astype(float), axis=0))
        counts += (np.diff(ways, axis=0) != 0).sum(axis=0)
        if came_back(int(counts.max(initial=0))):
            break
    return int(counts.max(initial=0))
