"""The columns of the report for rules whose steps vary."""

from __future__ import annotations

from typing import Any

from ..report.view import View, measured_column
from ..report.wording import NONE, mapping, number, scientific


def _order(case: dict[str, Any]) -> str:
    found = number(mapping(case, "measured").get("order"))
    return NONE if found is None else f"{found:.3f}"


def _wanted(expected: dict[str, Any]) -> str:
    parts = [f"order {expected.get('order')}"]
    for key, what in (("back", "back"), ("form", "form")):
        limit = expected.get(key)
        if limit is not None:
            parts.append(limit if isinstance(limit, str) else f"{what} ≤ {scientific(limit)}")
    return "; ".join([*parts, "no drift"] if "slope_limit" in expected else parts)


def _got(measured: dict[str, Any]) -> str:
    order = number(measured.get("order"))
    parts = [] if order is None else [f"order {order:.3f}"]
    for key in ("back", "form", "band"):
        value = number(measured.get(key))
        parts += [] if value is None else [f"{key} {scientific(value)}"]
    return ", ".join(parts) or NONE


VIEW = View(
    columns=[
        ("Order", _order), measured_column("back", "There and back"),
        measured_column("form", "Extended form"), measured_column("band", "Energy band"),
        measured_column("slope", "Energy slope"),
    ],
    wanted=_wanted, got=_got, short=_got,
)  # fmt: skip
