"""Pictures of lattices: what a site and step costs against the number of sites."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..report.canvas import Panel, Sheet, log_axis, log_limits
from ..report.labels import end_labels
from ..report.palette import MUTED, Mark
from ..report.wording import Case, mapping, number, rows, rule_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COST_SHEET = Sheet(width=3.3, right=1.2)


def of_kind(case: Case, kind: str) -> Case:
    """The case with its rows of one kind alone."""
    return {**case, "rows": [row for row in rows(case) if row.get("kind") == kind]}


def cost(title: str, cases: Sequence[Case], marks: dict[str, Mark]) -> Panel:
    """Time of a site and step of one lattice against its number of sites; beside C where known."""

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
