"""The page of orders: how they are shown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ..report import plot_convergence
from ..report.canvas import Panel, Sheet
from ..report.grouping import by_scene, figures_by_precision
from ..report.palette import Mark
from ..report.view import Sketch, Titles, View
from ..report.wording import (
    NONE,
    Case,
    in_unusual_chart,
    mapping,
    number,
    plus_minus,
    rows,
)  # fmt: skip

CONVERGENCE = (
    "Error in (x, μ) at the end of the run against step size; the number beside a rule is the "
    "fitted order. Filled marks are in the fit. Hollow marks are left out because the error is "
    "not yet asymptotic there, crosses because round-off has taken over; a bar on the upper edge "
    "is a run that failed. The triangles show the slopes that are expected. Where curves coincide "
    "the line has the colours of all of them in turn and the marks lie within one another."
)

DIGITS = 50  # digits of the family's runs
FAMILY_CAPTION = (
    "Error in (x, μ) against step size at 50 digits, to the same time: rules of order 1 to 8 on a "
    "scene of each kind of groupoid (pair, group, action, product). " + CONVERGENCE
)


def _got(measured: dict[str, Any]) -> str:
    processed = number(measured.get("effective"))
    found = plus_minus(measured.get("order"), measured.get("interval"))
    found += " (against its own runs)" if measured.get("why_not") else ""
    return found + ("" if processed is None else f", processed {processed:g}")


def _wanted(expected: dict[str, Any]) -> str:
    if number(expected.get("order")) is None:
        return "only measured"
    tolerance = number(expected.get("tolerance"))
    said = f"{expected['order']:g}" + (f" ± {tolerance:g}" if tolerance is not None else "")
    declared = number(expected.get("declared"))
    lopsided = "" if declared is None else f" (declared {declared:g}; in this chart ι(u) ≠ −u)"
    processed = number(expected.get("effective"))
    return said + lopsided + ("" if processed is None else f", processed {processed:g}")


def _short(measured: dict[str, Any]) -> str:
    found = number(measured.get("order"))
    return NONE if found is None else f"{found:.4f}"


def _multipliers(case: Case) -> str:
    found = number(mapping(case, "measured").get("multipliers"))
    return NONE if found is None else f"{found:.3f}"


def _points(case: Case) -> str:
    """Return the points of the fit, and why others were left out."""
    every, used = rows(case), mapping(case, "measured").get("points")
    why = Counter(str(row.get("why_not") or "left out") for row in every if not row.get("used"))
    if used is None:
        used = len(every) - why.total()
    said = ", ".join(f"{count} {reason}" for reason, count in why.items())
    return f"{used} of {len(every)}" + (f" ({said})" if said else "")


def _compared(case: Case) -> dict[str, Any]:
    # below a thousand roundings an error is no longer the method's
    least = 1e3 * (2.0**-53 if case["digits"] == 16 else 10.0 ** -case["digits"])
    errors = {r["step"]: r["error"] for r in case["rows"] if r["error"] and r["error"] > least}
    return {"order": case["measured"].get("order"), "errors": errors, "time": case.get("duration")}


def _room(sheet: Sheet, cases: Sequence[Case]) -> Sheet:
    """Return a sheet with a wider margin if names of rules carry their retraction."""
    more = 0.24 if any(map(in_unusual_chart, cases)) else 0.0
    return replace(sheet, width=sheet.width + more, right=sheet.right + more)


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    def panels(scene: str, own: Sequence[Case], digits: int) -> list[Panel]:
        return [plot_convergence.panel(titles.get(scene, scene), own, known)]

    sheet = _room(plot_convergence.SHEET, cases)
    joined = [case for case in cases if _of_family(case)]
    if len(by_scene(joined)) < 2 or len(joined) == len(cases):
        return figures_by_precision("order", "Convergence", CONVERGENCE, cases, sheet, panels)
    there = by_scene(joined).keys()
    family = [c for c in cases if c.get("scene") in there and int(c.get("digits") or 16) == DIGITS]
    drawn = [panel for scene, own in by_scene(family).items() for panel in panels(scene, own, 50)]
    others = [case for case in cases if not _of_family(case)]
    first = figures_by_precision("order", "Convergence", CONVERGENCE, others, sheet, panels)
    square = replace(sheet, columns=2)
    return [Sketch("order-family", "Orders 1 to 8", FAMILY_CAPTION, drawn, square, DIGITS), *first]


def _of_family(case: Case) -> bool:
    """True for one of the short runs that are added if nothing is chosen (`family_cases`)."""
    return int(case.get("digits") or 16) == DIGITS and " --steps " in str(case.get("command"))


VIEW = View(
    columns=[
        ("Order", lambda case: _got(mapping(case, "measured"))),
        ("Order of multipliers", _multipliers),
        ("Points", _points),
    ],
    got=_got, wanted=_wanted, short=_short, sketches=_sketches, compared=_compared,
)  # fmt: skip
