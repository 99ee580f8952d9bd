"""The page of orders: how they are shown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ..core.result import NONE, Result
from ..report import plot_convergence
from ..report.canvas import Panel, Sheet
from ..report.grouping import by_scene, figures_by_precision
from ..report.palette import Mark
from ..report.plot_convergence import Line, Point
from ..report.view import Sketch, Titles, View
from ..report.wording import order_of, plus_minus, raised, scientific
from . import plot_varied
from .records import Expected, Measured, Row, constant, to_time

Case = Result[Measured, Expected, Row]

CONVERGENCE = (
    "Error in (x, μ) at the time t, the end of the run, against step size; the number beside a "
    "rule is the fitted order. Filled marks are in the fit. Hollow marks are left out because the "
    "error is not yet asymptotic there, crosses because round-off has taken over; a bar on the "
    "upper edge is a run that failed. The triangles show the slopes that are expected. Where "
    "curves coincide the line has the colours of all of them in turn and the marks lie within one "
    "another."
)

DIGITS = 50  # digits of the family's runs
FAMILY_CAPTION = (
    "Error in (x, μ) against step size at 50 digits, to the same time: rules of order 1 to 8 on a "
    "scene of each kind of groupoid (pair, group, action, product). " + CONVERGENCE
)


def _got(case: Case) -> str:
    measured = case.measured
    text = plus_minus(measured.order, measured.interval)
    text += " (against its own runs)" if measured.why_not else ""
    return text if measured.effective is None else f"{text}, processed {measured.effective:g}"


def _wanted(case: Case) -> str:
    expected = case.expected
    if expected.order is None:
        return "only measured"
    said = f"{expected.order:g}"
    said += "" if expected.tolerance is None else f" ± {expected.tolerance:g}"
    said += " or above" if expected.or_above else ""
    if expected.declared is not None:
        said += f" (declared {expected.declared:g}; in this chart ι(u) ≠ −u)"
    return said if expected.effective is None else f"{said}, processed {expected.effective:g}"


def _short(case: Case) -> str:
    return NONE if case.measured.order is None else order_of(case.measured.order)


def _multipliers(case: Case) -> str:
    return NONE if case.measured.multipliers is None else f"{case.measured.multipliers:.3f}"


def _constant(case: Case) -> str:
    """Return C hᵖ, p the whole number next to the order, and the time of that error."""
    size = constant(case.rows, case.measured.order)
    power = raised(round(case.measured.order or 0))
    return NONE if size is None else f"{scientific(size, 2)} {power}{to_time(case)}"


def _points(case: Case) -> str:
    """Return the points of the fit, and why others were left out."""
    why = Counter(row.why_not or "left out" for row in case.rows if not row.used)
    used = case.measured.points
    used = len(case.rows) - why.total() if used is None else used
    said = ", ".join(f"{count} {reason}" for reason, count in why.items())
    return f"{used} of {len(case.rows)}" + (f" ({said})" if said else "")


def _compared(case: Case) -> dict[str, Any]:
    # below a thousand roundings an error is no longer the method's
    least = 1e3 * (2.0**-53 if case.digits == 16 else 10.0**-case.digits)
    errors = {row.step: row.error for row in case.rows if row.error and row.error > least}
    return {"order": case.figures.get("order"), "errors": errors, "time": case.details.duration}


def _line(case: Case) -> Line:
    points = [Point(row.step, row.error, row.used, row.why_not) for row in case.rows]
    return Line(case, points, case.measured.order, case.expected.order)


def _room(sheet: Sheet, cases: Sequence[Case]) -> Sheet:
    """Return a sheet with a wider margin if names of rules carry their retraction."""
    more = 0.24 if any(case.in_unusual_chart for case in cases) else 0.0
    return replace(sheet, width=sheet.width + more, right=sheet.right + more)


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    def panels(scene: str, own: Sequence[Case], digits: int) -> list[Panel]:
        alike = len({to_time(case) for case in own}) == 1
        what = f"error in (x, μ){to_time(own[0]) if alike else ' at the end of each run'}"
        lines = [replace(_line(case), more="" if alike else to_time(case)) for case in own]
        return [plot_convergence.panel(titles.get(scene, scene), lines, known, what)]

    if own := list(plot_varied.sketches(cases)):  # a line for each value would hide all others
        return own
    sheet = _room(plot_convergence.SHEET, cases)
    joined = [case for case in cases if _of_family(case)]
    if len(by_scene(joined)) < 2 or len(joined) == len(cases):
        return figures_by_precision("order", "Convergence", CONVERGENCE, cases, sheet, panels)
    there = by_scene(joined).keys()
    family = [case for case in cases if case.scene in there and case.digits == DIGITS]
    drawn = [panel for scene, own in by_scene(family).items() for panel in panels(scene, own, 50)]
    others = [case for case in cases if not _of_family(case)]
    first = figures_by_precision("order", "Convergence", CONVERGENCE, others, sheet, panels)
    square = replace(sheet, columns=2)
    return [Sketch("order-family", "Orders 1 to 8", FAMILY_CAPTION, drawn, square, DIGITS), *first]


def _of_family(case: Case) -> bool:
    """True for one of the short runs that are added if nothing is chosen (`family_cases`)."""
    return case.digits == DIGITS and " --steps " in case.command


VIEW = View(
    measured=Measured, expected=Expected, row=Row,
    columns=[
        ("Order", _got),
        ("Order of multipliers", _multipliers),
        ("Error constant", _constant),
        ("Points", _points),
    ],
    got=_got, wanted=_wanted, short=_short, paper=[("order", _got), ("C", _constant)],
    sketches=_sketches, compared=_compared,
)  # fmt: skip
