"""The judge of references: all digits that were asked for are proven."""

from __future__ import annotations

from typing import Any

from discmech.studies.core.case import Case, Verdict


def judge(case: Case, measurement: dict[str, Any]) -> Verdict:
    """A case passes if all digits that were asked for are proven."""
    proven, expected = measurement["measured"]["proven"], {"digits": case.digits}
    if proven >= case.digits:
        return Verdict("pass", "", expected)
    return Verdict("fail", f"only {proven} digits are certain.", expected)
