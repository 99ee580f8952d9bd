"""The judge of charts: a run is right, or stops where it has to; it is never silently wrong."""

from __future__ import annotations

import math
from typing import Any

from discmech.studies.core.case import Case, Measurement, Verdict
from discmech.studies.momentum.limits import LIMITS as OF_MOMENTA
from discmech.studies.symplecticity.limits import LIMITS as OF_STEPS

from .limits import FORMS, LIMITS, SOLVED


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Judge that runs are right, or stop beside the singular set of FL or without a solution."""
    unit = 10.0 ** (16 - case.digits)
    limits = dict.fromkeys(SOLVED, LIMITS["solved"] * unit)
    limits |= dict.fromkeys(FORMS, LIMITS["forms"] * unit)
    expected: dict[str, Any] = {"limits": limits, "singular": LIMITS["singular"]}
    for row in measurement.rows:
        axis = "a drawn axis" if row["axis"] is None else f"axis {row['axis']}"
        where = f"at {row['turn']:g} of a turn about {axis}"
        rounded = OF_STEPS["step"] * 2.0**-53 * math.sqrt(row["steps"])
        walk = OF_MOMENTA["walk"] / math.sqrt(3) * rounded
        allowed = {**limits, "momentum": walk * unit}
        for name, limit in allowed.items():
            if row[name] is not None and not row[name] <= limit:
                said = f"{name} {row[name]:.2g} {where}, more than {limit:.0e}."
                return Verdict("fail", said, expected)
        near = row["regularity"] is not None and row["regularity"] < LIMITS["singular"]
        none_there = row["solutions"] == 0
        if row["outcome"] == "stopped" and row["steps"] and not near and not none_there:
            return Verdict("fail", f"it stopped {where}: {row['cause']}.", expected)
    stopped = measurement.measured["stopped"]
    if stopped > int(LIMITS["stopped"] * len(measurement.rows)):
        return Verdict("inconclusive", f"{stopped} runs stopped; try another --steps.", expected)
    return Verdict("pass", "", expected)
