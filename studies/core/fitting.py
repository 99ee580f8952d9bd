"""Straight lines through measured points: slopes with intervals, asymptotic windows."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from discmech.integrators.errors import CannotMeasure


@dataclass(frozen=True)
class Line:
    """A least-squares line: slope, its interval (of 95 %), and the largest residual."""

    slope: float
    interval: tuple[float, float]
    residual: float


def fit_line(
    x: Sequence[float] | np.ndarray, y: Sequence[float] | np.ndarray, level: float = 0.95
) -> Line:
    """Return a least-squares line through at least three points; raises `CannotMeasure` for fewer.

    The interval of that level is for residuals that are independent of one another.
    """
    if len(x) < 3:
        raise CannotMeasure(f"a line needs three points, not {len(x)}: take more --steps.")
    from scipy.special import stdtrit

    xs, ys = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    size = _power_of_two(ys)  # squares of values that grow without end are no doubles
    ys = ys / size
    dx = xs - xs.mean()
    slope = float(dx @ (ys - ys.mean()) / (dx @ dx))
    residuals = ys - ys.mean() - slope * dx
    freedom = len(xs) - 2
    error = math.sqrt(float(residuals @ residuals) / freedom / float(dx @ dx))
    half = float(stdtrit(freedom, (1 + level) / 2)) * error
    most = float(np.abs(residuals).max()) * size
    return Line(slope * size, ((slope - half) * size, (slope + half) * size), most)


def _power_of_two(values: np.ndarray) -> float:
    """Return the largest power of two up to the largest value; 1 without one."""
    most = np.abs(values).max(initial=0.0)
    return float(2.0 ** np.floor(np.log2(most))) if 0 < most < np.inf else 1.0


#: numbers of parts whose means represent a series, the largest first
BATCHES = (64, 32, 16, 8)


def batch_line(
    times: np.ndarray,
    values: np.ndarray,
    level: float = 0.95,
    of: Callable[..., Any] = np.mean,
    batches: Sequence[int] = BATCHES,
) -> Line:
    """Return the line through the means of equal parts of a series with correlated neighbours.

    (Batch means: Law, Simulation Modeling and Analysis, 9.5.) Errors of consecutive steps depend on
    one another, so as single points they would give the slope a far too small interval. Parts are
    joined until the residuals are uncorrelated, |r₁| ≤ 2/√parts. of: minima or maxima of the parts
    instead. If a series is too short for parts, each value is one.
    """
    line = None
    for count in batches:
        if len(values) < 4 * count:
            continue
        edges = np.linspace(0, len(values), count + 1).astype(int)
        parts = list(itertools.pairwise(edges.tolist()))
        middles = np.array([times[a:b].mean() for a, b in parts])
        statistics = np.array([of(values[a:b]) for a, b in parts])
        line = fit_line(middles, statistics, level)
        rest = statistics - statistics.mean() - line.slope * (middles - middles.mean())
        rest = rest / _power_of_two(rest)
        size = float(rest @ rest)
        if not size or abs(float(rest[1:] @ rest[:-1])) <= 2 * size / math.sqrt(count):
            break
    return fit_line(times, values, level) if line is None else line


def steadiness(values: np.ndarray) -> float:
    """Return the distance from first to last value over the length of the way: 1 if monotonic.

    A drift goes one way, even where it slows down; a random walk goes to and fro.
    """
    way = np.diff(values)
    taken = np.abs(way).sum()
    return float(abs(way.sum()) / taken) if taken > 0 and np.isfinite(taken) else 1.0


def orders_between(steps: Sequence[float], errors: Sequence[float]) -> list[float]:
    """Return the order from each error to the next; not a number where one is 0 or not finite."""

    def order(h: float, shorter: float, error: float, finer: float) -> float:
        ratio = error / finer if finer else math.nan
        known = 0 < ratio < math.inf
        return math.log2(ratio) / math.log2(h / shorter) if known else math.nan

    pairs = zip(itertools.pairwise(steps), itertools.pairwise(errors), strict=True)
    return [order(*ends, *both) for ends, both in pairs]


#: round-off of many steps (√N units) still bends errors that are this many floors large: 2¹² floors
#: of 32 ε are the farthest point, (5/√3)√N ε, of a walk of 1.4·10⁵ roundings where that is a 120th
#: of the error and so changes log₂ of it by 0.012
BENT = 2**12


def bent_below(round_off: float, straight: float) -> float:
    """Return the error whose log₂ round-off of that size changes by `straight`."""
    return round_off / (2**straight - 1)


@dataclass(frozen=True)
class Window:
    """The asymptotic part of a convergence ladder, points first..last (inclusive)."""

    first: int
    last: int
    line: Line


def asymptotic_window(
    steps: Sequence[float], errors: Sequence[float], floor: float, straight: float,
    known: Sequence[float] | None = None,
) -> Window | None:  # fmt: skip
    """The longest run of at least four points that is straight in log–log, the finest of those.

    steps: step sizes from coarse to fine; errors: beside them (nan where a run failed). Points at
    or below `floor` are round-off. Straight: no point is further than `straight` (in log₂ of the
    error) from the line. Beyond the fine end only points that round-off may have bent are left out
    (up to BENT × floor): a line that errors leave earlier is not yet their asymptotic one. The
    slope is signed: errors that grow give no positive order. known: what round-off can do to each
    point, where that was measured; it bends what it is more than `straight` of.
    """
    most = [0.0] * len(errors) if known is None else known
    usable = [math.isfinite(e) and e > max(floor, k) for e, k in zip(errors, most, strict=True)]
    logs = [math.log2(e) if good else math.nan for e, good in zip(errors, usable, strict=True)]
    bends = [max(BENT * floor, bent_below(k, straight)) for k in most]
    excused = [not math.isfinite(e) or e <= b for e, b in zip(errors, bends, strict=True)]
    steps_log = [math.log2(h) for h in steps]
    best: Window | None = None
    for first in range(len(steps)):
        for last in range(first + 3, len(steps)):
            if not all(usable[first : last + 1]):
                break
            if not all(excused[last + 1 :]):
                continue
            line = fit_line(steps_log[first : last + 1], logs[first : last + 1])
            if line.residual > straight:
                continue
            if best is None or last - first >= best.last - best.first:
                best = Window(first, last, line)
    return best


def marks(
    errors: Sequence[float | None], window: Window | None, floor: float
) -> list[dict[str, Any]]:
    """Return {"used"} of each row, and {"why_not"} where its error is no part of the line."""
    first, last = (len(errors), len(errors)) if window is None else (window.first, window.last)
    rows: list[dict[str, Any]] = []
    for i, error in enumerate(errors):
        used = error is not None and first <= i <= last
        rows.append({"used": used})
        if error is not None:
            below = i > last or error <= floor
            rows[-1]["why_not"] = "" if used else "round-off" if below else "pre-asymptotic"
    return rows


def line_of(window: Window | None) -> dict[str, Any]:
    """Return {"order", "interval", "points"} of the line through a window."""
    if window is None:
        return {"order": None, "interval": None, "points": 0}
    line = window.line
    points = window.last - window.first + 1
    return {"order": line.slope, "interval": list(line.interval), "points": points}
