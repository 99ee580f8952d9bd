"""The judge of an error of the energy along a run: a band between two edges, or a drift."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from ..core.case import Verdict
from ..core.decisions import decision
from ..systems.runs import FAR
from .judging_modified import drifting, of_long_run
from .limits import LIMITS
from .records import NOT_BACK, Found


def judge_errors(unit: float, record: Found, not_demanded: str = "") -> Verdict:
    """Return the verdict on a result of `measured_errors`.

    unit: of round-off, relative. not_demanded: the reason where nothing is demanded.
    """
    band, slope, duration = record.band, record.slope, record.duration
    round_off = max((change.round_off for change in record.modified or []), default=0.0)
    expected: dict[str, Any] = {"slope_limit": allowed_rise(unit, band, round_off) / duration}
    fail, unknown = (partial(Verdict, v, expected=expected) for v in ("fail", "inconclusive"))
    if not np.isfinite(band):
        return fail("the energy is no longer finite.")
    edges = record.measured.edge_slopes
    if not_demanded:
        return Verdict("pass", "", {"not_demanded": not_demanded})
    quarters = record.quarters or []
    if comes_late(band, quarters):
        said = f"half of the run has {max(quarters[:2]) / band:.1%} of the error of the energy"
        if all(after >= 2 * before for before, after in itertools.pairwise(quarters)):
            return fail(f"{said}, and each quarter twice that before: it grows.")
        return unknown(f"{said}: take more --steps.")
    settled = _settled(record, expected)
    if abs(slope) <= expected["slope_limit"] or are_steady(edges, expected["slope_limit"]):
        drifts = record.drifts
        if not drifts and band > LIMITS["whole"]:  # no motion of the scene has such an energy
            said = f"the energy is off by {band:.2g} times what moves"
            return settled or unknown(f"{said}, so the run follows no motion: take a smaller step.")
        if not drifts:
            return settled or Verdict("pass", "", expected)
        last, rate, *_ = drifts[-1]
        said = f"the energy drifts by {rate * last:.2g} over t = {last:.4g}, "
        said += f"{abs(rate) * last / band:.1%} of its band" if band else "all of its band"
        first, longer, *_ = *(each[0] for each in drifts), duration
        again = f"the same in one {longer / first:.0f} times as long"
        if _continues(drifts):
            said += f": certain in one run, and {again}."
            return drifting(said, rate * last, expected)
        once = f", and not {again}" if longer > first else ", the only one made"
        return unknown(f"{said}: certain in one run{once}; take more --steps.")
    low, high = record.measured.slope_interval or (0.0, 0.0)
    steady = 1.0 if record.steady is None else record.steady
    if low <= 0 <= high or not goes_steadily(steady):
        return settled or unknown(
            "the run is too short to tell a drift from a wandering band: take more --steps."
        )
    if record.turns is not None and not came_back(record.turns):
        return unknown(NOT_BACK)
    said = f"the energy drifts by {slope * duration:.2g} over t = {duration:.4g}, "
    said += f"which is {abs(slope) * duration / band:.0%} of its band."
    return drifting(said, slope * duration, expected)


@decision
def verdict_of_run(unit: float, record: Found) -> str:
    """Return the word of the verdict on a run, with changes of the modified energy if it has some.

    Its rows are not read.
    """
    return of_long_run(record, judge_errors(unit, record)).verdict


@decision
def has_edges(
    unit: float, band: float, slope: float, duration: float, edges: Sequence[float] | None
) -> bool:
    """True if the slope of a run, or those of both edges, are a small share of the band."""
    allowed = allowed_rise(unit, band) / duration
    return not abs(slope) > allowed or are_steady(edges, allowed)


def allowed_rise(unit: float, band: float, round_off: float = 0.0) -> float:
    """Return the largest rise of a slope over the run: a share of the band, or round-off."""
    return max(band * LIMITS["slope"], 1e4 * unit, round_off)


@decision
def is_rise(unit: float, rise: float) -> bool:
    """True if a rise over the run is more than round-off."""
    return rise > allowed_rise(unit, 0.0)


def are_steady(edge_slopes: Sequence[float] | None, allowed: float) -> bool:
    """True if both edges of the errors are known, and rise by at most `allowed` a unit of time."""
    return edge_slopes is not None and max(map(abs, edge_slopes)) <= allowed


@decision
def goes_steadily(steadiness: float) -> bool:
    """True if a mean goes one way (`errors._steadiness`)."""
    return steadiness >= LIMITS["steady"]


@decision
def came_back(turns: int) -> bool:
    """True if a coordinate turns so often that the motion has come back."""
    return turns >= LIMITS["turns"]


@decision
def is_wide(band: float) -> bool:
    """True for a band of a run that is no longer near its motion, or no number."""
    return not band <= LIMITS["wide"]


@decision
def comes_late(band: float, quarters: Sequence[float]) -> bool:
    """True if an error is wide, and was not there in the first half of the run."""
    wide = band > LIMITS["wide"] and len(quarters) == 4
    return wide and FAR * max(quarters[:2]) < band


def _continues(drifts: Sequence[Sequence[float]]) -> bool:
    """True if a longer run has the same drift: slopes whose intervals meet."""
    if len(drifts) < 2:
        return False
    (*_, low, high), (*_, lowest, highest) = drifts[:2]
    return max(low, lowest) <= min(high, highest)


def _settled(record: Found, expected: Mapping[str, Any]) -> Verdict | None:
    """Return the verdict on a large error that stays after the first half of the run, or None.

    A band is filled again and again. If the motion ends with it, the method has taken its energy;
    if the motion continues, it may be a flight away from the place of the errors.
    """
    band, quarters = record.band, record.quarters or []
    if not (len(quarters) == 4 and FAR * max(quarters[2:]) < band):
        return None
    said = f"the energy's error, {band:.2g} of what moves, comes in half of the run and stays"
    if record.still:
        return Verdict("fail", f"{said}, and the motion comes to rest.", expected)
    if band <= LIMITS["wide"]:
        return None
    said += ", so it is no band: take a smaller step, or fewer --steps."
    return Verdict("inconclusive", said, expected)
