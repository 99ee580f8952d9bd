"""The judge of savings: they change the work and not the result."""

from __future__ import annotations

from discmech.studies.core.case import Case, Measurement, Verdict

from .limits import LIMITS


def judge(case: Case, measurement: Measurement) -> Verdict:
    """Savings change the work and not the result."""
    expected = {"limit": LIMITS["same"]}
    for row in measurement.rows:
        if not row["difference"] <= LIMITS["same"]:
            said = f"without the saving {row['variant']!r} the momenta differ by "
            return Verdict("fail", f"{said}{row['difference']:.2g}.", expected)
    return Verdict("pass", "", expected)
