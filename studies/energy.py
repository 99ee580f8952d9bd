"""Energy over long runs: its band and its secular slope."""

from __future__ import annotations

from typing import Any

import numpy as np

from .case import Case, Choice, Progress, Verdict, plain_cases, silent
from .fitting import fit_line
from .runs import bins, energy_errors, long_run

NAME = "energy"
NEEDS = "it needs a Lagrangian that is quadratic in the velocity."
DIGITS = (16,)
ROWS = 2000
SHARE = 0.1  # of the band that a slope may explain
LONGER = (1, 8, 32)  # times the steps, until it is told
PARTS, STEADY = 8, 0.8  # a drift takes the means of so many parts of the run one way


def cases(choice: Choice) -> list[Case]:
    """Every scene with a Lagrangian by every rule, in double precision unless asked otherwise."""
    return [c for c in plain_cases(NAME, choice, DIGITS) if c.scene.lagrangian is not None]


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Rows {time, error}: (H − H₀) over the largest sum of H's absolute terms, signed.

    Of each stretch of the run the rows keep the smallest and the largest error, in order, so the
    band of all steps is seen. band: largest minus smallest; slope: per unit of time through all
    steps, with its 95 % interval.

    In a chaotic scene the mean of the band wanders, slowly: what looks like a drift and is none
    shrinks against the band in a longer run, so such a case runs eight times as long, and 32 times
    (kirchhoff by trapezoidal: 15 %, 23 % and 2 % of the same band).
    """
    steps = case.steps or (10**6 if case.digits == 16 else 1000)
    for more in LONGER:
        run = long_run(case, case.scheme, more * steps, progress)
        errors = energy_errors(case.scheme, run, case.digits)
        times = np.asarray(run.t, dtype=float)
        line = fit_line(times, errors)
        small = not abs(line.slope) * times[-1] > _allowed(case, float(np.ptp(errors)))
        standing = _edges_stand(errors, _allowed(case, float(np.ptp(errors))))
        if small or standing or _steadiness(errors) >= STEADY:
            break  # a drift goes one way and a longer run would only repeat it
    rows = []
    for first, last in bins(len(times), ROWS // 2):
        part = errors[first:last]
        ends = sorted({first + int(part.argmin()), first + int(part.argmax())})
        rows += [{"time": float(times[i]), "error": float(errors[i])} for i in ends]
    return {
        "rows": rows,
        "measured": {
            "band": float(np.ptp(errors)),
            "slope": line.slope,
            "slope_interval": list(line.interval),
        },
        "steady": _steadiness(errors),
        "standing": standing,
        "duration": float(times[-1]),
    }


def _allowed(case: Case, band: float) -> float:
    """What a slope may add up to over the run: a share of the band, or round-off."""
    return max(band * SHARE, 1e4 * (2.0**-53 if case.digits == 16 else 10.0**-case.digits))


def _steadiness(errors: np.ndarray) -> float:
    """How far the means of the parts go, over the way that they take: 1 if always the same way.

    A drift goes one way, even where it slows down; a band that wanders, as in chaotic motion, goes
    to and fro.
    """
    way = np.diff([errors[a:b].mean() for a, b in bins(len(errors), PARTS)])
    taken = np.abs(way).sum()
    return float(abs(way.sum()) / taken) if taken > 0 and np.isfinite(taken) else 1.0


def _edges_stand(errors: np.ndarray, allowed: float) -> bool:
    """Whether both edges of the band, from part to part of the run, move by no more than allowed.

    A secular drift c t moves the minimum and the maximum of every part along by c t. The mean in
    between may wander, in chaotic motion for as long as anyone has looked, and to a side that
    depends on round-off: edges that stand rule a drift out, whatever the mean does.
    """
    parts = [errors[a:b] for a, b in bins(len(errors), PARTS)]
    if len(parts) < PARTS or not np.isfinite(errors).all():
        return False
    where = (np.arange(PARTS) + 0.5) / PARTS  # as a share of the run
    edges = np.array([[part.min(), part.max()] for part in parts])
    return bool((np.abs(np.polyfit(where, edges, 1)[0]) <= allowed).all())


def judge(case: Case, measurement: dict[str, Any]) -> Verdict:
    """No secular drift: over the run the slope accounts for at most a tenth of the band.

    A method that loses or gains energy steadily has a band that is all slope. Where the mean only
    wanders between two edges that stand, nothing drifts either.
    """
    band, slope = measurement["measured"]["band"], measurement["measured"]["slope"]
    duration = measurement["duration"]
    expected = {"slope_limit": _allowed(case, band) / duration}
    if not np.isfinite(band):
        return Verdict("fail", "the energy is no longer finite.", expected)
    if abs(slope) <= expected["slope_limit"] or measurement.get("standing", False):
        return Verdict("pass", "", expected)
    low, high = measurement["measured"]["slope_interval"]
    if low <= 0 <= high or measurement.get("steady", 1.0) < STEADY:
        return Verdict(
            "inconclusive",
            "the run is too short to tell a drift from a wandering band: take more --steps.",
            expected,
        )
    return Verdict(
        "fail",
        f"the energy drifts by {slope * duration:.2g} over t = {duration:.4g}, "
        f"which is {abs(slope) * duration / band:.0%} of its band.",
        expected,
    )
