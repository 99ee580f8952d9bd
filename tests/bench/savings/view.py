"""How savings are shown."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from discmech.studies.core.result import NONE, AnyResult
from discmech.studies.report.view import View
from discmech.studies.report.wording import duration, scientific


def _variants(case: AnyResult, key: str, written: Callable[[Any], str]) -> str:
    """A column's entries: the kernel as it is, then without each saving; a line each if it can."""
    return " | ".join(written(row[key]) for row in case.rows) or NONE


def _got(case: AnyResult) -> str:
    times = case.figures["times"].items()
    return "; ".join(f"{name} {ratio:.3g}×" for name, ratio in times) or NONE


VIEW = View(
    columns=[
        ("Saving not made", lambda case: _variants(case, "variant", str)),
        ("Operations a step", lambda case: _variants(case, "operations", "{:.1f}".format)),
        ("Newton", lambda case: _variants(case, "corrections", "{:.2f}".format)),
        ("Bytes kept", lambda case: _variants(case, "bytes", str)),
        ("Time a step", lambda case: _variants(case, "seconds", duration)),
        ("Times as long", lambda case: _variants(case, "times", "{:.2f}×".format)),
    ],
    got=_got,
    wanted=lambda case: f"the same results to {scientific(case.wanted.get('limit'))}",
)
