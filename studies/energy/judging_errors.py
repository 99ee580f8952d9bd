"""The judge of an error of the energy along a run: a band between two edges, or a drift."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from ..core.case import Case, Verdict
from ..systems.runs import FAR
from .errors import allowed_rise, are_steady
from .judging_modified import NOT_BACK, drifting
from .limits import LIMITS
from .records import Found


def judge_errors(case: Case, record: Found, kept: bool = True) -> Verdict:
    """Return the verdict on a result of `measured_errors`; kept: False if nothing is demanded."""
    band, slope, duration = record.band, record.slope, record.duration
    round_off = max((change.round_off for change in record.modified or []), default=0.0)
    expected: dict[str, Any] = {"slope_limit": allowed_rise(case, band, round_off) / duration}
    fail, unknown = (partial(Verdict, v, expected=expected) for v in ("fail", "inconclusive"))
    if not np.isfinite(band):
        return fail("the energy is no longer finite.")
    edges = record.measured.edge_slopes
    if not kept:
        return Verdict("pass", "", {"not_demanded": case.scene.no_energy})
    if comes_late(record):
        quarters = record.quarters or []
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
        if _continues(drifts):
            said += ": certain, and the same in a run eight times as long."
            return drifting(said, rate * last, expected)
        once = "certain in one run, and not in one eight times as long"
        return unknown(f"{said}: {once}; take more --steps.")
    low, high = record.measured.slope_interval or (0.0, 0.0)
    steady = 1.0 if record.steady is None else record.steady
    if low <= 0 <= high or steady < LIMITS["steady"]:
        return settled or unknown(
            "the run is too short to tell a drift from a wandering band: take more --steps."
        )
    if record.turns is not None and record.turns < LIMITS["turns"]:
        return unknown(NOT_BACK)
    said = f"the energy drifts by {slope * duration:.2g} over t = {duration:.4g}, "
    said += f"which is {abs(slope) * duration / band:.0%} of its band."
    return drifting(said, slope * duration, expected)


def comes_late(record: Found) -> bool:
    """True if an error is wide, and was not there in the first half of the run."""
    quarters = record.quarters or []
    wide = record.band > LIMITS["wide"] and len(quarters) == 4
    return wide and FAR * max(quarters[:2]) < record.band


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
