"""The judge of extremes: nothing fails silently."""

from __future__ import annotations

from ..core.case import Case, Measurement, Verdict
from ..core.records import decoded
from .records import Row


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Return the verdict: no error may be silent; without a reference, no sign proves nothing."""
    expected, rows = {"silent": 0}, [decoded(Row, row) for row in measurement.rows]
    for row in rows:
        if row.outcome == "wrong, silent":
            reason = f"at hω = {row.z:g} is wrong by {row.error:.2g}, and neither smaller "
            reason += f"steps ({row.estimate:.2g}) nor the energy tell."
            return Verdict("fail", reason, expected)
    for row in rows:
        if row.outcome == "no reference" and not row.noticed:
            reason = f"at hω = {row.z:g} nothing looks wrong, and no reference says it is right."
            return Verdict("inconclusive", reason, expected)
    return Verdict("pass", "", expected)
