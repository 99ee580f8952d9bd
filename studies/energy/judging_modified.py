"""The judge of the modified energy: on a run, and on runs from places beside the motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ..core.case import Verdict
from ..core.outcome import OF_DRIFT
from ..systems.modified_change import Change
from .limits import LIMITS
from .modified import certain_drift, covers, drift_beside, goes_one_way, resolved, stands
from .records import Found

NOT_BACK = (
    "the energy goes one way, and so it may with a part of the motion that has not come back: take "
    "more --steps."
)


def drifting(said: str, drift: float, expected: Mapping[str, Any]) -> Verdict:
    """Return a fail by a drift, which tables show as the one that was measured."""
    return Verdict("fail", said, expected, measured={"drift": drift}, why=OF_DRIFT)


def judge(record: Found, verdict: Verdict) -> Verdict:
    """Return the verdict with the modified energy. verdict: the one on the energy's band alone.

    If it stays along the run, there is no drift, for any part of the motion that the run is too
    short for. If it goes one way, farther than any state on the way explains, that is a drift,
    however small beside the band. In between, a drift of the energy may be a slow part of the
    motion, which is not failed, and an energy that seems to stay is trusted only if the modified
    one does not go one way.
    """
    band, duration, changes = record.band, record.duration, record.modified or []
    rows = resolved(changes, band)
    drift = certain_drift(rows)
    if drift is not None:
        change, line = drift.modified, record.slope * duration
        known = 2 * abs(line) >= abs(change) or record.still
        if verdict.verdict == "fail" and known:
            return verdict  # the line through all rows shows the same, and rest is the reason
        return drifting(_drifts(change, drift.time), change, verdict.expected)
    # a quadratic modified energy stays beyond the limit of stability too
    if band <= LIMITS["whole"]:
        verdict = _of_run(verdict, rows, bool(changes), band, duration)
    told = drift_beside(record.beside or [])
    if told is not None and verdict.verdict != "fail":
        place, drift = told
        where = ", ".join(f"{e:.4g}" for e in place.place)
        said = f"beside the motion, from (x, μ) = ({where}) with the step {place.step:.4g}, "
        said += _drifts(drift.modified, drift.time)
        return drifting(said, drift.modified, verdict.expected)
    return verdict


def of_long_run(record: Found, verdict: Verdict) -> Verdict:
    """Return `judge` of a lattice's run, or the given verdict if the rows are not of its energy.

    The states of the rows show the energy's own change too: if the line through the run's energy
    rises by more than twice that, something else than the motion is measured.
    """
    rows = record.modified or []
    if not rows:
        return verdict
    seen = max(abs(r.energy) + r.round_off for r in rows)
    line = abs(record.slope * record.duration)
    return judge(record, verdict) if line <= 2 * seen else verdict


def _of_run(
    verdict: Verdict, rows: Sequence[Change], has_changes: bool, band: float, duration: float
) -> Verdict:
    """Return the verdict on the scene's own run, if its modified energy has no certain drift."""
    if not rows or not covers(rows, duration):
        if verdict.verdict == "fail" and has_changes:
            return Verdict("inconclusive", NOT_BACK, verdict.expected)
        return verdict
    if stands(rows, band):
        limit = max(r.bound for r in rows)
        return Verdict("pass", "", {**verdict.expected, "modified_limit": limit})
    if verdict.verdict == "fail" and all(
        abs(r.modified) <= r.bound + r.walk + LIMITS["beyond"] * r.path for r in rows
    ):
        return Verdict("inconclusive", NOT_BACK, verdict.expected)
    last = rows[-1]
    another_form = LIMITS["beyond"] * last.form
    beyond = abs(last.modified) > last.bound + last.walk + another_form
    if verdict.verdict == "pass" and beyond and goes_one_way(rows) and band > last.round_off:
        said = (
            "the energy only seems to oscillate: the modified energy, which should not, changes by "
            f"{last.modified:.2g} of the energy that moves, always one way; take more --steps."
        )
        return Verdict("inconclusive", said, verdict.expected)
    return verdict


def _drifts(change: float, time: float) -> str:
    return (
        f"the energy drifts by {change:.2g} of the energy that moves over t = {time:.4g}, which no "
        "oscillation of its error explains."
    )
