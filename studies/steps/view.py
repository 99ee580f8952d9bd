"""The columns of the report for rules whose steps vary."""

from __future__ import annotations

from ..core.result import NONE, Result
from ..report.view import View, decimals, measured_column
from ..report.wording import scientific
from .records import Expected, Measured

Case = Result[Measured, Expected, object]


def _wanted(case: Case) -> str:
    expected = case.expected
    parts = ["only measured" if expected.order is None else f"order {expected.order}"]
    for what, limit in (("back", expected.back), ("form", expected.form)):
        if limit is not None:
            parts.append(limit if isinstance(limit, str) else f"{what} ≤ {scientific(limit)}")
    return "; ".join([*parts, "no drift"] if expected.slope_limit is not None else parts)


def _got(case: Case) -> str:
    numbers = case.measured
    parts = [] if numbers.order is None else [f"order {numbers.order:.3f}"]
    for name, value in (("back", numbers.back), ("form", numbers.form), ("band", numbers.band)):
        parts += [] if value is None else [f"{name} {scientific(value)}"]
    return ", ".join(parts) or NONE


VIEW = View(
    measured=Measured, expected=Expected,
    columns=[
        ("Order", lambda case: decimals(case.measured.order, 3)),
        measured_column("back", "There and back"),
        measured_column("form", "Extended form"), measured_column("band", "Energy band"),
        measured_column("slope", "Energy slope"),
    ],
    wanted=_wanted, got=_got,
)  # fmt: skip
