"""Energy over long runs: its band and its secular slope."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from discmech.integrators.errors import CannotMeasure, StepFailure
from discmech.integrators.flows import Trajectory

from ..causes.round_off import lost_one_way
from ..core.case import (
    Case,
    Choice,
    Measurement,
    Progress,
    Verdict,
    lattice_cases,
    plain_cases,
    silent,
)
from ..core.claims import not_claimed
from ..core.fitting import BATCHES, Line, batch_line, fit_line, steadiness
from ..core.moving_energy import may_end
from ..core.outcome import Row
from ..core.runs import FAR, bins, refuse_ended
from ..evidence.verdicts import CONSISTENCY, consistency_of
from ..systems import System, system_of
from . import balance, modified

NAME = "energy"
NEEDS = "it needs a Lagrangian."
DIGITS = (16,)
ROWS = 2000
#: turns of the coordinate that turns most often: in a shorter run the motion has not come back. Two
#: periods, each of which has two
TURNS = 4
STRETCH = 4096  # rows that are examined before the next
ALONE = 20_000  # steps of a forced scene without its force
WIDE = 0.1  # share of the energy that moves: a wider band is called unresolved where it is shown
SHARE = 0.1  # share of the band that a slope may explain
LONGER = (1, 8, 32)  # factors of the steps, until the verdict is clear
PARTS, STEADY = 8, 0.8  # a drift moves the means of so many parts of the run one way
ErrorsOf = Callable[[int], tuple[np.ndarray, np.ndarray]]
CERTAIN = 0.999  # level of the intervals of mean and edges, which must not contain 0 in a drift
#: parts of a drift's run, in eighths of `BATCHES`. If a whole number of periods is nearly a part of
#: the run, means of the parts rise slowly and steadily without a drift (aliasing): where the run is
#: so many periods to within a quarter, one in 16 with 8 parts, one in 1000 with 7, 8 and 9
PARTITIONS = (8, 7, 9)


def cases(choice: Choice) -> list[Case]:
    """Return every scene with a Lagrangian with every rule, in double precision by default."""
    found = [
        c
        for c in plain_cases(NAME, choice, DIGITS)
        if c.scene.lagrangian is not None or c.scene.in_numbers
    ]
    return [*found, *lattice_cases(NAME, choice)]


def measure(case: Case, progress: Progress = silent) -> dict[str, Any]:
    """Return the result of the run (`_measure`), and the consistency of single steps."""
    _ = case.scheme  # errors of scene or rule are reported before parts of it are derived
    return {**_measure(case, progress), CONSISTENCY: consistency_of(case)}


def _measure(case: Case, progress: Progress) -> dict[str, Any]:
    """Return rows {time, error}: (H − H₀) over the energy that moves (`moving_energy`), signed.

    In each stretch of the run the rows keep the smallest and the largest error, in order, so the
    band of all steps shows. band: largest minus smallest; slope: per unit of time through all
    steps, with its 95 % interval from batch means. edge_slopes: those of the lines through the
    minima and the maxima of the run's parts; None for a run too short to have parts, or not finite.

    In a chaotic scene the mean of the band wanders, slowly and to a side that depends on round-off.
    If its edges seem to move as well, and not steadily, the case runs eight times as long, and 32
    times: wandering shrinks against the band. If a drift is certain (`certain_drift`) but less than
    a share of the band, the case runs eight times as long too: a drift continues. drifts: the
    certain ones, as [duration, slope, low, high], one per run.

    If a force or the time changes the energy, it is compared with their work (`balance`).
    """
    system = system_of(case)
    if "modified_energy" in system.lacks:
        return _by_long_runs(case, system, progress)
    steps = _steps(case)
    if balance.applies(case):
        alone = _alone(case)
        if not balance.acts(case.scene, steps * float(case.scene.step)):
            return _measure(alone, progress)
        if case.rule.is_recorded:
            raise CannotMeasure(
                f"{case.scene.name}: its energy is held against the work of each step, and "
                "recorded runs have no further steps."
            )
        found = balance.measure(case, progress)
        with suppress(CannotMeasure, StepFailure):  # another motion, which may be unknown
            found["alone"] = _measure(replace(alone, steps=case.steps or ALONE), progress)
        return found

    also: dict[str, Any] = {"still": False, "modified": [], "beside": modified.beside(case)}
    at_places = modified.drift_beside(also["beside"]) is not None

    def errors_of(more: int) -> tuple[np.ndarray, np.ndarray]:
        run = system.long_run(more * steps, progress)
        times, errors = np.asarray(run.t, dtype=float), system.energy_errors(run)
        # beyond a collision it is wide, or the scale is that of the collision
        if not np.ptp(errors) <= WIDE or may_end(case.scene):
            refuse_ended(case, float(times[-1]))
        also["still"], also["turns"] = _comes_to_rest(run), turns_of(run)
        if more == LONGER[0]:
            also["modified"] = modified.measured(case, run, more * steps)
        return times, errors

    def is_enough(band: float, duration: float) -> bool:
        rows = modified.resolved(also["modified"], band)
        whole = modified.covers(rows, duration) and modified.stands(rows, band)
        whole = whole and band <= modified.WHOLE
        return at_places or whole or modified.certain_drift(rows) is not None

    found = {**measured_errors(case, errors_of, is_enough), **also}
    _add_drift(found)
    return found


def measure_more(case: Case, measurement: Measurement, said: Verdict) -> dict[str, Any]:
    """Return lost: the possible drift of the energy if the rule's own formulas lose digits.

    Under a force it is that of the run without it, if there was one.
    """
    if "modified_energy" in system_of(case).lacks:
        return {}
    if "balance_order" in measurement.measured:
        if "alone" not in measurement:
            return {}
        alone = replace(_alone(case), steps=case.steps or ALONE)
        return {"alone": {**measurement["alone"], "lost": _lost(alone)}}
    if said.verdict != "fail" and said.reason != modified.NOT_BACK:
        return {}
    return {"lost": _lost(_alone(case) if balance.applies(case) else case)}


def _alone(case: Case) -> Case:
    """Return the case without its force, and with its time held."""
    return replace(case, scene=balance.left_alone(case.scene))


def _lost(case: Case) -> float:
    return lost_one_way(case, _steps(case))


def _steps(case: Case) -> int:
    claimed = not not_claimed(case.rule, "energy")
    return case.steps or (system_of(case).usual_steps(claimed) if case.digits == 16 else 1000)


def _by_long_runs(case: Case, system: System, progress: Progress) -> dict[str, Any]:
    """Return `_measure` of a system without a modified energy: runs get longer until they decide.

    slopes: those of each run.
    """
    steps, slopes = case.steps or system.usual_steps(), dict[float, float]()
    for times in system.slower:

        def errors_of(more: int, times: int = times) -> tuple[np.ndarray, np.ndarray]:
            run = system.long_run(times * more * steps, progress)
            return run.t, system.energy_errors(run)

        found = measured_errors(case, errors_of)
        slopes[found["duration"]] = found["measured"]["slope"]
        held = Measurement.of(found)
        said = judge_errors(case, held).verdict
        if said != "pass":  # a slow part may come and go, which the modified energy leaves out
            taken = math.ceil(found["duration"] / float(case.scene.step))
            found["modified"] = system.modified_changes(taken)
            held = Measurement.of(found)
            said = modified.of_long_run(held, judge_errors(case, held)).verdict
        if said == "pass" or (said == "inconclusive" and times > 1):
            break
    found["measured"]["drift"] = found["measured"]["slope"] * found["duration"]
    return {**found, "slopes": [*slopes.values()]}


def _comes_to_rest(run: Trajectory) -> bool:
    """True if the second half of a run moves less than a quarter as far as the first, x and μ.

    A motion that preserves volume and stays in a bounded region comes back (Poincaré), and a free
    flight moves on. Without a base μ alone may end in a point, as on a group that is not
    unimodular, so it is False there.
    """
    x, mu = (np.asarray(part, dtype=float) for part in (run.x, run.mu))
    half = len(x) // 2
    return x.shape[1] > 0 and all(
        FAR * np.ptp(part[half:], axis=0).max() < np.ptp(part[:half], axis=0).max()
        for part in (x, mu)
    )


def turns_of(run: Trajectory) -> int:
    """Return how often the coordinate that turns most often turns in a run, counted to `TURNS`."""
    parts = [np.asarray(part) for part in (run.x, run.mu)]
    found = np.zeros(sum(part.shape[1] for part in parts), dtype=int)
    for first in range(0, len(parts[1]) - 2, STRETCH):  # the first stretch is mostly enough
        rows = slice(first, first + STRETCH + 2)
        ways = np.sign(np.diff(np.hstack([part[rows] for part in parts]).astype(float), axis=0))
        found += (np.diff(ways, axis=0) != 0).sum(axis=0)
        if found.max(initial=0) >= TURNS:
            break
    return int(found.max(initial=0))


def _add_drift(found: Row) -> None:
    """Add to `measured` the drift over the run: of the modified energy, or along the slope."""
    measured = found["measured"]
    rows = modified.resolved(found["modified"], measured["band"])
    slope = measured["slope"] * found["duration"]
    measured["drift"] = rows[-1]["modified"] if rows else slope


def measured_errors(
    case: Case, errors_of: ErrorsOf, is_enough: Callable[[float, float], bool] | None = None
) -> dict[str, Any]:
    """Return `measure` for a function that gives (times, errors) of a run that is so many times as
    long.

    is_enough: (band, duration) ↦ True if no longer run is needed.
    """
    drifts: list[list[float]] = []
    for more in LONGER[:1] if case.rule.is_recorded else LONGER:
        times, errors = errors_of(more)
        line = fit_line(times, errors)
        edges = _edge_slopes(times, errors)
        allowed = _allowed(case, float(np.ptp(errors))) / times[-1]
        inside = not abs(line.slope) > allowed or _are_steady(edges, allowed)
        drift = certain_drift(case, times, errors)
        if drift is not None:
            drifts.append([float(times[-1]), drift.slope, *drift.interval])
        if is_enough is not None and is_enough(float(np.ptp(errors)), float(times[-1])):
            break
        if inside and drift is not None and len(drifts) == 1 and more < LONGER[-1]:
            continue
        if inside or _steadiness(errors) >= STEADY:
            break  # a drift goes one way, and a longer run would only repeat it
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
            "slope_interval": _interval(line, times, errors),
            "edge_slopes": edges,
        },
        "steady": _steadiness(errors),
        "quarters": [float(np.ptp(errors[a:b])) for a, b in bins(len(errors), 4)],
        "drifts": drifts,
        "duration": float(times[-1]),
    }


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
    if len(errors) < 256 or not np.isfinite(errors).all() or _steadiness(errors) < STEADY:
        return None
    mean, *others = (
        batch_line(times, errors, CERTAIN, of, [count * k // 8 for count in BATCHES])
        for k in PARTITIONS for of in (np.mean, np.min, np.max)
    )  # fmt: skip
    ends = [end * np.sign(mean.slope) for line in (mean, *others) for end in line.interval]
    beyond = abs(mean.slope) * times[-1] > _allowed(case, 0.0)
    return mean if beyond and min(ends) > 0 else None


def _continues(drifts: list[list[float]]) -> bool:
    """True if a longer run has the same drift: slopes whose intervals meet."""
    if len(drifts) < 2:
        return False
    (*_, low, high), (*_, lowest, highest) = drifts[:2]
    return max(low, lowest) <= min(high, highest)


def _allowed(case: Case, band: float, round_off: float = 0.0) -> float:
    """Return the largest rise of a slope over the run: a share of the band, or round-off."""
    return max(band * SHARE, 1e4 * case.rule.unit(case.digits), round_off)


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


def _are_steady(edge_slopes: list[float] | None, allowed: float) -> bool:
    return edge_slopes is not None and max(map(abs, edge_slopes)) <= allowed


def judge_errors(case: Case, measurement: Measurement, kept: bool = True) -> Verdict:
    """Return the verdict on a result of `measured_errors`; kept: False if nothing is demanded."""
    band, slope = measurement.measured["band"], measurement.measured["slope"]
    duration = measurement["duration"]
    round_off = max((r["round_off"] for r in measurement.get("modified") or []), default=0.0)
    expected: dict[str, Any] = {"slope_limit": _allowed(case, band, round_off) / duration}
    fail, unknown = (partial(Verdict, v, expected=expected) for v in ("fail", "inconclusive"))
    if not np.isfinite(band):
        return fail("the energy is no longer finite.")
    edges = measurement.measured.get("edge_slopes")
    if not kept:
        return Verdict("pass", "", {"not_demanded": "nonholonomic: measured only"})
    quarters = measurement.get("quarters") or []
    if band > WIDE and len(quarters) == 4 and FAR * max(quarters[:2]) < band:
        said = f"half of the run has {max(quarters[:2]) / band:.1%} of the error of the energy"
        if all(after >= 2 * before for before, after in itertools.pairwise(quarters)):
            return fail(f"{said}, and each quarter twice that before: it grows.")
        return unknown(f"{said}: take more --steps.")
    settled = _settled(measurement, expected)
    if abs(slope) <= expected["slope_limit"] or _are_steady(edges, expected["slope_limit"]):
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
    if low <= 0 <= high or measurement.get("steady", 1.0) < STEADY:
        return settled or unknown(
            "the run is too short to tell a drift from a wandering band: take more --steps."
        )
    if measurement.get("turns", TURNS) < TURNS:
        return unknown(modified.NOT_BACK)
    return fail(
        f"the energy drifts by {slope * duration:.2g} over t = {duration:.4g}, "
        f"which is {abs(slope) * duration / band:.0%} of its band."
    )


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
    if band <= WIDE:
        return None
    said += ", so it is no band: take a smaller step, or fewer --steps."
    return Verdict("inconclusive", said, expected)
