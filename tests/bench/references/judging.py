"""The judge of references: all digits that were asked for are proven."""

from __future__ import annotations

from discmech.studies.core.case import Case, Measurement, Verdict


def judge(case: Case, measurement: Measurement) -> Verdict:
    """A case passes if all digits that were asked for are proven."""
    proven, expected = measurement.measured["proven"], {"digits": case.digits}
    if proven >= case.digits:
        return Verdict("pass", "", expected)
    return Verdict("fail", f"only {proven} digits are certain.", expected)
