"""The page of lattices: how measurements are shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from ..core.result import NONE, Result
from ..report import plot_convergence
from ..report.alike import shares
from ..report.canvas import Panel, Sheet, log_axis, log_limits
from ..report.grouping import by_scene
from ..report.labels import end_labels
from ..report.palette import MUTED, SHORT, Mark
from ..report.plot_convergence import Line, Point
from ..report.view import Sketch, Titles, View, decimals, measured_column
from ..report.wording import scientific
from .records import Expected, Measured, Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Case = Result[Measured, Expected, Row]
COST_SHEET = Sheet(width=3.3, right=1.2)

SPACE = (
    "Error in (x, μ) at t = 4 against the spacing of the grid, against breather and kink of the "
    "sine-Gordon equation in closed form, with steps of an eighth of the spacing: central "
    "differences are of order 2, by whatever rule the time is stepped."
)
COST = (
    "Processor time of a site and step against the number of sites N, the least of some runs in "
    "turn, and the power of N with which a whole step grows (slope). Dashed: plain loops in C. "
    "Times are of this machine and are not judged."
)
FORMS = ("poisson", "patch", "residual")  # the first is for controls alone


def _forms(case: Case) -> str:
    pairs = [(name, getattr(case.measured, name)) for name in FORMS]
    return ", ".join(f"{k} {scientific(v)}" for k, v in pairs if v is not None) or NONE


def _contact(case: Case) -> str:
    measured = case.measured
    if not measured.contact:
        return NONE
    worst, defect = max(measured.contact.items(), key=lambda law: law[1])
    rise = scientific(measured.rises[0])
    return f"{measured.impacts} impacts, {worst} {scientific(defect)}, energy rises by {rise}"


def _wanted(case: Case) -> str:
    expected = case.expected
    if expected.laws is not None:
        return f"laws of contact ≤ {scientific(expected.laws)}"
    if expected.at_least is not None:
        return f"≥ {scientific(expected.at_least)}"
    order = expected.space_order
    said = "" if order is None else f"order in space {order}, "
    if case.measured.patch is None:  # with forces or constraints, or on groups
        return f"{said}residual ≤ {scientific(expected.residual)}"
    return f"{said}law on patches ≤ {scientific(expected.limit)}"


def _got(case: Case) -> str:
    if case.measured.contact:
        return _contact(case)
    order = case.measured.space_order
    parts = ("" if order is None else f"order in space {order:.3f}", _forms(case))
    return ", ".join(part for part in parts if part not in ("", NONE)) or NONE


def _of_kind(case: Case, kind: str) -> list[Row]:
    return [row for row in case.rows if row.kind == kind]


def _cost(case: Case) -> str:
    rows = _of_kind(case, "cost")
    if not rows or not rows[-1].nanoseconds:
        return NONE
    last, slope = rows[-1], _slope(case)
    in_c = f" (C {last.c:.3g})" if last.c else ""
    return f"{last.nanoseconds:.3g}{in_c} at {last.sites:g}" + (f", {slope}" if slope else "")


def _slope(case: Case) -> str:
    """Return the power of N in words; "" where the clock shows none, as on a busy machine."""
    power = None if case.measured.grows is None else case.measured.grows.time
    return "" if power is None else f"slope {power:.2f}"


def _memory(case: Case) -> str:
    rows = _of_kind(case, "cost")
    return f"{rows[-1].bytes:.0f}" if rows else NONE


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    own = by_scene([case for case in cases if not case.control])

    def sketch(kind: str, title: str, about: str, sheet: Sheet, panel: Any) -> Sketch:
        panels = []
        for scene, of in own.items():
            if drawn := [case for case in of if _of_kind(case, kind)]:
                panels.append(panel(titles.get(scene, scene), drawn))
        return Sketch(f"lattices-{kind}", f"Lattices: {title}", about, panels, sheet, 16)

    def in_space(name: str, of: list[Case]) -> Panel:
        lines = list(map(_line, of))
        return plot_convergence.panel(name, lines, known, "error", "spacing of the grid")

    return [
        sketch("space", "order in space", SPACE, plot_convergence.SHEET, in_space),
        sketch("cost", "cost", COST, COST_SHEET, partial(_costs, known)),
    ]


def _costs(marks: dict[str, Mark], title: str, cases: Sequence[Case]) -> Panel:
    """Return the panel of time per site and step against the number of sites; beside C if known."""

    def draw(axes: Axes) -> None:
        curves: list[tuple[list[tuple[float, float]], str, Mark, bool]] = []
        for case in cases:
            mark = marks[case.method]
            words = "\n".join(filter(None, (case.method, _slope(case))))
            rows = _of_kind(case, "cost")
            curves.append(([(r.sites, r.nanoseconds) for r in rows if r.sites and r.nanoseconds],
                           words, mark, False))  # fmt: skip
            if in_c := [(row.sites, row.c) for row in rows if row.sites and row.c]:
                curves.append((in_c, f"{case.method}, C", replace(mark, dash=SHORT), True))
        points = [point for curve, *_ in curves for point in curve]
        log_axis(axes, "x", log_limits((n for n, _ in points), 0.05))
        log_axis(axes, "y", log_limits((t for _, t in points), 0.1))
        labels = []
        drawn = [curve for curve, *_ in curves]
        for (curve, words, mark, loops), share in zip(curves, shares(axes, drawn), strict=True):
            own = share.marks(3.6) | ({"mfc": "none", "mec": mark.colour} if loops else {})
            line = share.line(mark, 0.9)
            axes.plot(
                *zip(*curve, strict=True), color=mark.colour, marker=mark.marker, **own, **line
            )
            labels.append((*curve[-1], words, MUTED if loops else mark.colour))
        end_labels(axes, labels)

    spoken = f"{title}: nanoseconds of a site and step against the number of sites. "
    spoken += "; ".join(case.method for case in cases)
    return Panel(title, "ns a site and step", "sites N", spoken, draw)


def _line(case: Case) -> Line:
    rows = [Point(r.step, r.error, r.used, r.why_not) for r in _of_kind(case, "space")]
    order = case.expected.space_order
    return Line(case, rows, case.measured.space_order, None if order is None else float(order))


VIEW = View(
    measured=Measured, expected=Expected, row=Row,
    columns=[
        ("Order in space", lambda case: decimals(case.measured.space_order, 3)),
        ("Contact", _contact),
        measured_column("patch", "Law on patches"), measured_column("residual"),
        ("ns a site and step", _cost), ("Bytes a site", _memory),
    ],
    got=_got, wanted=_wanted, sketches=_sketches,
)  # fmt: skip
