"""The judge of races: errors sink until rounding or the budget ends them."""

from __future__ import annotations

from ..core.case import Case, Measurement, Verdict
from ..evidence.judging import demand_consistency
from .enough import FEWEST, errors_of
from .limits import LIMITS


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Judge that the errors of a method sink until rounding ends them, and that it is consistent.

    The budget may end a ladder before the errors show that a method follows another motion, which
    single steps do.
    """
    return demand_consistency(measurement, _of_runs(measurement))


def _of_runs(measurement: Measurement) -> Verdict:
    """Judge that the errors of a method sink until rounding or the budget ends them.

    Errors that stop above √ε, and a thousand times above the floor, belong to another problem. Not
    so where the budget ended the ladder before one is the share of sinking errors of 1, which is
    the error of a state at rest: no step may be short enough for errors to sink. Time is never
    judged: if the budget left fewer than `FEWEST` runs, and none of them is as accurate, the
    verdict is open; two runs whose errors sink may converge to any limit. A method that makes
    no step at any setting fails, as in every other study.
    """
    metric = "error" if measurement["periods"] is None else "energy-max"
    limit = max(LIMITS["stalled"], LIMITS["floors"] * measurement["floor"].get(metric, 0.0))
    expected = {"limit": limit}
    errors = errors_of(measurement.rows, metric)
    if not errors:
        causes = [row["cause"] for row in measurement.rows if row["cause"]]
        if causes and all(row["steps"] == 0 for row in measurement.rows):
            return Verdict("fail", f"no run makes a step: {causes[-1]}.", expected)
        why = causes[-1] if causes else measurement.measured["cut"]
        return Verdict("inconclusive", f"no run came to its end: {why}.", expected)
    best, share = min(errors), LIMITS["sinking"]
    if best <= limit or (len(errors) >= FEWEST and min(errors[-2:]) <= share * min(errors[:-2])):
        return Verdict("pass", "", expected)
    if len(errors) < FEWEST:
        reason = (
            f"the budget left too few runs ({len(errors)}, the best with an error of {best:.2g}): "
            "--budget gives more."
        )
        return Verdict("inconclusive", reason, expected)
    if best > share and measurement.measured["cut"]:
        reason = (
            f"no run within the budget resolves the motion, the best has an error of {best:.2g}: "
            "--budget gives more."
        )
        return Verdict("inconclusive", reason, expected)
    reason = f"the errors stop sinking at {best:.2g}: it solves another problem."
    return Verdict("fail", reason, expected)
