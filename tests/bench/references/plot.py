"""The cost of references, with the growth laws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from discmech.studies.report.canvas import Panel, Sheet, log_axis, log_limits
from discmech.studies.report.labels import end_labels
from discmech.studies.report.palette import BLUE, MUTED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from discmech.studies.core.result import AnyResult

SHEET = Sheet(width=3.4, right=1.1, columns=2)


def panels(cases: Sequence[AnyResult]) -> list[Panel]:
    """Seconds against digits at one time, and against time at one number of digits."""
    made = []
    for kind, title, xlabel in (("digits", "Against digits", "certain digits"),
                                ("time", "Against time", "t")):  # fmt: skip
        rows = [case.figures for case in cases if case.details.kind == kind]
        if rows:
            same = f"t = {rows[0]['time']:g}" if kind == "digits" else f"{rows[0]['digits']} digits"
            subtitle = f"{cases[0].scene}, {same}"
            made.append(_panel(title, subtitle, xlabel, rows, kind, rows[0]["growth"]))
    return made


def _panel(
    title: str,
    subtitle: str,
    xlabel: str,
    rows: Sequence[Mapping[str, Any]],
    by: str,
    found: float | None,
) -> Panel:
    points = [(row[by], row["seconds"]) for row in rows]

    def draw(axes: Axes) -> None:
        log_axis(axes, "x", log_limits(x for x, _ in points))
        log_axis(axes, "y", log_limits(y for _, y in points))
        end, top = points[-1]
        labels = [(end, top, "measured", BLUE)]
        if found is not None:
            law = [top * (x / end) ** found for x, _ in points]
            axes.plot([x for x, _ in points], law, color=MUTED, lw=0.9, ls=(0, (1, 1.6)))
            labels.append((end, top, f"slope {found:g}", MUTED))
        axes.plot(*zip(*points, strict=True), color=BLUE, marker="o", ms=3.5, lw=1.1)
        end_labels(axes, labels)

    spoken = f"{title}: " + "; ".join(f"{x:g}: {y:.3g} seconds" for x, y in points)
    return Panel(title, f"processor seconds, {subtitle}", xlabel, spoken, draw)
