"""The judge of the modified energy: on a run, and on runs from places beside the motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..core.case import Verdict
from ..core.decisions import decision
from ..core.fitting import steadiness
from ..core.outcome import OF_DRIFT
from ..systems.modified_change import Change
from .limits import LIMITS
from .records import NOT_BACK, Beside, Found


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
        said = f"{place}, {_drifts(drift.modified, drift.time)}"
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


@decision
def seems_to_drift(rows: Sequence[Change]) -> bool:
    """True if the modified energy goes one way, or drifts for certain, with the canonical form."""
    beyond = abs(rows[-1].modified) > rows[-1].bound
    return (beyond and goes_one_way(rows)) or certain_drift(rows) is not None


@decision
def drifts_beside(places: Sequence[Beside]) -> bool:
    """True if the energy drifts for certain from a place beside the motion."""
    return drift_beside(places) is not None


@decision
def is_told(changes: Sequence[Change], band: float, duration: float) -> bool:
    """True if the modified energy along a run says what longer runs could say.

    A band within the round-off of its steps has no edges, and a longer run has more round-off.
    """
    if covers(changes, duration) and band <= changes[-1].round_off:
        return True
    rows = resolved(changes, band)
    whole = covers(rows, duration) and stands(rows, band) and band <= LIMITS["whole"]
    return bool(whole or certain_drift(rows) is not None)


@decision
def drift_of(changes: Sequence[Change], band: float) -> float | None:
    """Return the change of the modified energy to the last state that is resolved; None without."""
    rows = resolved(changes, band)
    return rows[-1].modified if rows else None


def resolved(rows: Sequence[Change], band: float) -> list[Change]:
    """Return the rows whose change is known to a share of the band, or to round-off.

    A way that changes H̃ − H by more than the band does shows something else than the run.
    """
    return [
        r for r in rows
        if r.bound <= max(LIMITS["known"] * band, 2 * r.round_off)
        and r.path <= max(LIMITS["elsewhere"] * band, 2 * r.round_off)
    ]  # fmt: skip


def certain_drift(rows: Sequence[Change]) -> Change | None:
    """Return the last resolved row if the modified energy goes one way, beyond any effect of
    states.

    For a symplectic method the changes vanish; if it keeps another form they are within a few times
    `form` (Newmark's β = 1/4 on an orbit that turns slowly). For another method they are as good as
    those of the energy where the state has come back, and are off by at most `path` where it has
    not. Or each of many states has gone farther than the one before, along a line, and they come
    back as near as before: no walk is so straight, and a slow part of the motion goes away.
    """
    if len(rows) < 3:
        return None
    last, values = rows[-1], np.array([0.0, *(r.modified for r in rows)])
    beyond = abs(last.modified) - last.bound - LIMITS["beyond"] * last.form
    farther = abs(np.sign(np.diff(values)).sum()) == len(rows)
    if beyond > 0 and len(rows) >= LIMITS["many"] and farther:
        times, paths = np.array([r.time for r in rows]), [r.path for r in rows]
        off = np.abs(values[1:] - times / times[-1] * values[-1]).max()
        half = len(rows) // 2
        as_near = 2 * max(paths[:half]) >= max(paths[half:])
        if off <= LIMITS["straight"] * abs(values[-1]) and as_near:
            return last
    beyond -= last.walk
    return last if beyond > LIMITS["beyond"] * last.path and goes_one_way(rows) else None


def drift_beside(places: Sequence[Beside]) -> tuple[Beside, Change] | None:
    """Return the first place from which the energy drifts for certain, and the row with it."""
    for place in places:
        drift = certain_drift(resolved(place.rows, place.band))
        if drift is not None:
            return place, drift
    return None


def stands(rows: Sequence[Change], band: float) -> bool:
    """True if the modified energy stays within its uncertainty, in every one of these rows."""
    most = LIMITS["stands"] * band
    return bool(rows) and all(
        abs(r.modified) <= min(r.bound, max(most, 2 * r.round_off)) for r in rows
    )


def covers(rows: Sequence[Change], duration: float) -> bool:
    """True if rows cover the whole run, to its last quarter."""
    return bool(rows) and rows[-1].time >= 0.75 * duration


def goes_one_way(rows: Sequence[Change]) -> bool:
    """True if the modified energy goes one way from row to row, on one side in the later half.

    One state far off, where the series of H̃ is worth little, is most of the way by itself.
    """
    values = np.array([0.0, *(r.modified for r in rows)])
    sides = np.sign(values[1 + len(rows) // 2 :])
    return steadiness(values) >= LIMITS["steady"] and abs(sides.sum()) == len(sides)
