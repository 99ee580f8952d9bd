"""The judge of an error of the energy along a run: a band between two edges, or a drift."""

from __future__ import annotations

import itertools
from functools import partial
from typing import Any

import numpy as np

from ..core.case import Case, Measurement, Verdict
from ..core.outcome import Row
from ..core.runs import FAR
from .errors import allowed_rise, are_steady
from .judging_modified import NOT_BACK
from .limits import LIMITS


def judge_errors(case: Case, measurement: Measurement, kept: bool = True) -> Verdict:
    """Return the verdict on a result of `measured_errors`; kept: False if nothing is demanded."""
    band, slope = measurement.measured["band"], measurement.measured["slope"]
    duration = measurement["duration"]
    round_off = max((r["round_off"] for r in measurement.get("modified") or []), default=0.0)
    expected: dict[str, Any] = {"slope_limit": allowed_rise(case, band, round_off) / duration}
    fail, unknown = (partial(Verdict, v, expected=expected) for v in ("fail", "inconclusive"))
    if not np.isfinite(band):
        return fail("the energy is no longer finite.")
    edges = measurement.measured.get("edge_slopes")
    if not kept:
        return Verdict("pass", "", {"not_demanded": case.scene.no_energy})
    quarters = measurement.get("quarters") or []
    if band > LIMITS["wide"] and len(quarters) == 4 and FAR * max(quarters[:2]) < band:
        said = f"half of the run has {max(quarters[:2]) / band:.1%} of the error of the energy"
        if all(after >= 2 * before for before, after in itertools.pairwise(quarters)):
            return fail(f"{said}, and each quarter twice that before: it grows.")
        return unknown(f"{said}: take more --steps.")
    settled = _settled(measurement, expected)
    if abs(slope) <= expected["slope_limit"] or are_steady(edges, expected["slope_limit"]):
        drifts = measurement.get("drifts")
        if not drifts:
            return settled or Verdict("pass", "", expected)
        last, rate, *_ = drifts[-1]
        said = f"the energy drifts by {rate * last:.2g} over t = {last:.4g}, "
        said += f"{abs(rate) * last / band:.1%} of its band" if band else "all of its band"
        if _continues(drifts):
            return fail(f"{said}: certain, and the same in a run eight times as long.")
        once = "certain in one run, and not in one eight times as long"
        return unknown(f"{said}: {once}; take more --steps.")
    low, high = measurement.measured["slope_interval"]
    if low <= 0 <= high or measurement.get("steady", 1.0) < LIMITS["steady"]:
        return settled or unknown(
            "the run is too short to tell a drift from a wandering band: take more --steps."
        )
    if measurement.get("turns", LIMITS["turns"]) < LIMITS["turns"]:
        return unknown(NOT_BACK)
    return fail(
        f"the energy drifts by {slope * duration:.2g} over t = {duration:.4g}, "
        f"which is {abs(slope) * duration / band:.0%} of its band."
    )


def _continues(drifts: list[list[float]]) -> bool:
    """True if a longer run has the same drift: slopes whose intervals meet."""
    if len(drifts) < 2:
        return False
    (*_, low, high), (*_, lowest, highest) = drifts[:2]
    return max(low, lowest) <= min(high, highest)


def _settled(measurement: Measurement, expected: Row) -> Verdict | None:
    """Return the verdict on a large error that stays after the first half of the run, or None.

    A band is filled again and again. If the motion ends with it, the method has taken its energy;
    if the motion continues, it may be a flight away from the place of the errors.
    """
    band, quarters = measurement.measured["band"], measurement.get("quarters") or []
    if not (len(quarters) == 4 and FAR * max(quarters[2:]) < band):
        return None
    said = f"the energy's error, {band:.2g} of what moves, comes in half of the run and stays"
    if measurement.get("still"):
        return Verdict("fail", f"{said}, and the motion comes to rest.", expected)
    if band <= LIMITS["wide"]:
        return None
    said += ", so it is no band: take a smaller step, or fewer --steps."
    return Verdict("inconclusive", said, expected)
