"""The judge of energy: no drift, but a band between two steady edges."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ..causes.round_off import unit, why_unknown
from ..core.case import Case, Measurement, Verdict
from ..core.claims import not_claimed
from ..core.records import decoded
from ..evidence.judging import demand_consistency
from ..order.limits import tolerance
from . import balance, judging_modified
from .judging_errors import judge_errors
from .limits import LIMITS
from .measuring import laws_of
from .records import NOT_BACK, Found


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Judge the secular drift: over the run the slope may account for at most a tenth of the band.

    A method that loses or gains energy steadily has a band that is all slope. If the mean only
    wanders between two edges that are steady by that measure, there is no drift either. But a drift
    that is certain, and is the same in a run eight times as long, is one however small it is beside
    the band: no variational integrator has it. One that is certain in one run only is undecided. An
    error that is large beside the energy's terms, and is not there in the first half of the run,
    has no band: a line through all rows does not show exponential growth. Its run of half as many
    steps may drift for all that. Nor does it show energy that is lost at the start and never comes
    back (`_settled`).

    And the steps have to be consistent: a method of another motion may keep an energy near this
    one's for ever. One that claims to keep the energy has to keep it in each step from a place.
    """
    laws = (law.name for law in laws_of(case))
    kept = "the energy keeps its law"
    return demand_consistency(measurement, _judge(case, measurement), *laws, kept=kept)


def _judge(case: Case, measurement: Measurement) -> Verdict:
    """Judge the run alone."""
    if reason := not_claimed(case.rule, "energy"):
        return Verdict("pass", "", {"not_demanded": reason})
    record = decoded(Found, measurement)
    if "balance_order" in measurement.measured:
        return _judge_balance(case, record)
    if record.slopes is not None:
        return _of_long_runs(case, record)
    unit = case.rule.unit(case.digits)
    verdict = judge_errors(unit, record, case.scene.no_energy)
    if not case.scene.no_energy and np.isfinite(record.band):
        verdict = judging_modified.judge(record, verdict)
    for place in record.beside or () if verdict.verdict == "pass" else ():
        if place.errors is not None:
            there = judge_errors(unit, decoded(Found, Measurement.of(place.errors)))
            if there.verdict == "fail":
                return replace(there, reason=f"{place}, {there.reason}")
    if verdict.verdict == "inconclusive" and record.before is not None:
        before = _judge(case, Measurement.of(record.before))
        if before.verdict == "fail":  # a longer run takes no drift back
            return before
    if case.rule.is_recorded:  # recorded runs cannot take other steps
        verdict = verdict.because(verdict.reason.replace("take more --steps", "record longer runs"))
    drift = record.measured.drift
    drift = abs(record.slope * record.duration if drift is None else drift)
    unsettled = verdict.verdict == "fail" or verdict.reason == NOT_BACK
    if unsettled and 0 < drift <= (lost := record.lost or 0.0):
        return Verdict("inconclusive", why_unknown("the energy", drift, lost), verdict.expected)
    return verdict


def _of_long_runs(case: Case, record: Found) -> Verdict:
    """Judge a narrow band by the last two runs: it drifts if their slopes are alike.

    They are alike within a factor of two, and of one sign. An energy that comes and goes changes
    its slope as runs get eight times as long.
    """
    slopes = record.slopes or [math.nan]
    verdict = judge_errors(case.rule.unit(case.digits), record)
    by_modified = judging_modified.of_long_run(record, verdict)
    if by_modified is not verdict and by_modified.verdict != "inconclusive":
        return by_modified
    alike = not np.isfinite(slopes[-1])
    alike = alike or (len(slopes) > 1 and 0.5 <= slopes[-1] / slopes[-2] <= 2)
    if verdict.verdict != "fail" or alike or record.band > LIMITS["wide"]:
        return verdict
    said = f"{verdict.reason} Its rate changes with the length of the run; take more --steps."
    return Verdict("inconclusive", said, verdict.expected)


def _judge_balance(case: Case, record: Found) -> Verdict:
    """Judge the balance of energy and work: it has to sink with the step by the method's order.

    The difference of two orders at steps halved twice is about what the next term of the error
    still adds to the last one (Richardson): a shortfall of that size is inconclusive, a larger one
    fails. A balance that moves by a few roundings a step has no order, and passes. And if nothing
    acts, the energy has to stay: a weak force does not excuse a method that loses it.
    """
    verdict = _sinks(case, record)
    if verdict.verdict == "fail" or record.alone is None:
        return verdict
    alone = judge(replace(case, scene=balance.left_alone(case.scene)), Measurement.of(record.alone))
    if alone.verdict != "fail":
        return verdict
    said = f"without its force, and with its time held, {alone.reason}"
    return Verdict("fail", said, verdict.expected)


def _sinks(case: Case, record: Found) -> Verdict:
    """Judge that the balance sinks with its order."""
    order = record.measured.balance_order
    order = None if order is None or math.isnan(order) else order
    expected = balance.wanted(case, tolerance(16))
    least = expected["balance_order"]
    if not np.isfinite(record.band):
        return Verdict("fail", "the energy is no longer finite.", expected)
    rounded = LIMITS["balance"] * unit(case.digits) * (record.steps or 0)
    if (record.way or 0.0) <= rounded or (order or 0) >= least:
        return Verdict("pass", "", expected)
    said = "does not sink" if order is None else f"sinks with the step's power {order:.2f} only"
    said = f"the balance of energy and work {said}"
    before, last = [math.nan, math.nan, *(record.balance_orders or ())][-2:]
    if not last < least - abs(last - before):
        said += f", after {before:.2f} at twice the step: take more --steps."
        return Verdict("inconclusive", said, expected)
    return Verdict("fail", f"{said}.", expected)


def diagnose(case: Case, measurement: Measurement) -> dict[str, Any] | None:
    """Return the cause of a drift, or of another motion, in the step itself (`of_law`)."""
    from ..causes.diagnosis import of_law

    return of_law(case, measurement, "energy")
