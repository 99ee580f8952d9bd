"""The page of lattices: how measurements are shown."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from ..report import plot_convergence
from ..report.canvas import Panel, Sheet, log_axis, log_limits
from ..report.grouping import by_scene
from ..report.labels import end_labels
from ..report.palette import MUTED, Mark
from ..report.view import Sketch, Titles, View, measured_column
from ..report.wording import NONE, Case, mapping, number, rows, rule_name, scientific

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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


def _forms(measured: dict[str, Any]) -> str:
    names = [k for k in FORMS if measured.get(k) is not None]
    return ", ".join(f"{k} {scientific(measured[k])}" for k in names) or NONE


def _contact(measured: dict[str, Any]) -> str:
    worst = max(measured["contact"], key=lambda name: measured["contact"][name])
    defect, rise = scientific(measured["contact"][worst]), scientific(measured["rises"][0])
    return f"{measured['impacts']} impacts, {worst} {defect}, energy rises by {rise}"


def _wanted(expected: dict[str, Any]) -> str:
    if "laws" in expected:
        return f"laws of contact ≤ {scientific(expected['laws'])}"
    if "at_least" in expected:
        return f"≥ {scientific(expected['at_least'])}"
    order = f"order in space {expected['space_order']}, " if "space_order" in expected else ""
    return f"{order}law on patches ≤ {scientific(expected.get('limit'))}"


def _got(measured: dict[str, Any]) -> str:
    if "contact" in measured:
        return _contact(measured)
    order = number(measured.get("space_order"))
    parts = ("" if order is None else f"order in space {order:.3f}", _forms(measured))
    return ", ".join(part for part in parts if part not in ("", NONE)) or NONE


def _space(case: Case) -> str:
    order = number(mapping(case, "measured").get("space_order"))
    return NONE if order is None else f"{order:.3f}"


def _of_kind(case: Case, kind: str) -> list[Any]:
    """Return the rows of one kind."""
    return [row for row in rows(case) if row.get("kind") == kind]


def _cost(case: Case) -> str:
    found = _of_kind(case, "cost")
    grows = mapping(case, "measured").get("grows")
    if not found or not grows:
        return NONE
    last = found[-1]
    in_c = f" (C {last['c']:.3g})" if last.get("c") else ""
    return f"{last['nanoseconds']:.3g}{in_c} at {last['sites']}, slope {grows['time']:.2f}"


def _memory(case: Case) -> str:
    found = _of_kind(case, "cost")
    return f"{found[-1]['bytes']:.0f}" if found else NONE


def _sketches(cases: Sequence[Case], known: dict[str, Mark], titles: Titles) -> list[Sketch]:
    own = by_scene([case for case in cases if not case.get("control")])

    def sketch(kind: str, title: str, about: str, sheet: Sheet, panel: Any) -> Sketch:
        panels = []
        for scene, of in own.items():
            found = [{**case, "rows": _of_kind(case, kind)} for case in of]
            if drawn := [case for case in found if case["rows"]]:
                panels.append(panel(titles.get(scene, scene), drawn))
        return Sketch(f"lattices-{kind}", f"Lattices: {title}", about, panels, sheet, 16)

    def in_space(name: str, of: list[Case]) -> Panel:
        spatial = list(map(_in_space, of))
        return plot_convergence.panel(name, spatial, known, "error", "spacing of the grid")

    return [
        sketch("space", "order in space", SPACE, plot_convergence.SHEET, in_space),
        sketch("cost", "cost", COST, COST_SHEET, partial(_costs, known)),
    ]


def _costs(marks: dict[str, Mark], title: str, cases: Sequence[Case]) -> Panel:
    """Return the panel of time per site and step against the number of sites; beside C if known."""

    def draw(axes: Axes) -> None:
        curves: list[tuple[list[tuple[float, float]], str, dict[str, Any]]] = []
        for case in cases:
            mark = marks[rule_name(case)]
            style: dict[str, Any] = {"color": mark.colour, "marker": mark.marker}
            style |= {"ms": 3.6, "lw": 0.9}
            power = number((mapping(case, "measured").get("grows") or {}).get("time"))
            words = rule_name(case) + (f"\nslope {power:.2f}" if power is not None else "")
            curves.append((_points(case, "nanoseconds"), words, style))
            if in_c := _points(case, "c"):
                style = {**style, "ls": (0, (2.0, 1.2)), "mfc": "none"}
                curves.append((in_c, f"{rule_name(case)}, C", style))
        points = [point for curve, _, _ in curves for point in curve]
        log_axis(axes, "x", log_limits((n for n, _ in points), 0.05))
        log_axis(axes, "y", log_limits((t for _, t in points), 0.1))
        labels = []
        for curve, words, style in curves:
            axes.plot(*zip(*curve, strict=True), **style)
            colour = MUTED if words.endswith(", C") else style["color"]
            labels.append((*curve[-1], words, colour))
        end_labels(axes, labels)

    spoken = f"{title}: nanoseconds of a site and step against the number of sites. "
    spoken += "; ".join(rule_name(case) for case in cases)
    return Panel(title, "ns a site and step", "sites N", spoken, draw)


def _points(case: Case, key: str) -> list[tuple[float, float]]:
    found = [(number(row.get("sites")), number(row.get(key))) for row in rows(case)]
    return [(n, t) for n, t in found if n and t]


def _in_space(case: Case) -> Case:
    """Return the case with the order in space in place of that in time."""
    measured, expected = mapping(case, "measured"), mapping(case, "expected")
    return {**case, "measured": {"order": measured.get("space_order")},
            "expected": {**expected, "order": expected.get("space_order")}}  # fmt: skip


VIEW = View(
    columns=[
        ("Order in space", _space),
        ("Contact", lambda case: _contact(m) if "contact" in (m := mapping(case, "measured"))
         else NONE),
        measured_column("patch", "Law on patches"), measured_column("residual"),
        ("ns a site and step", _cost), ("Bytes a site", _memory),
    ],
    got=_got, wanted=_wanted, short=lambda m: _contact(m) if "contact" in m else _got(m),
    sketches=_sketches,
)  # fmt: skip
