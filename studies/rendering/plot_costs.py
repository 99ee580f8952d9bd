"""The cost of references: a table for the terminal and a picture with the growth laws."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studies.rendering.canvas import Panel, Sheet, log_axis, log_limits, render
from studies.rendering.labels import end_labels
from studies.rendering.palette import BLUE, MUTED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from studies.rendering.wording import Case

SHEET = Sheet(width=3.4, right=1.1, columns=2)


def table(costs: Case) -> Any:
    """Both kinds of rows, with the slopes beneath."""
    from rich.table import Table

    shown = Table(title=f"Cost of certified digits: {costs['scene']}", caption=_law(costs))
    for heading in ("digits", "t", "seconds", "steps", "order", "certain by"):
        shown.add_column(heading, justify="left" if heading == "certain by" else "right")
    for kind in ("digits", "times"):
        for row in costs[kind]:
            shown.add_row(
                str(row["digits"]), f"{row['time']:g}", f"{row['seconds']:.3g}", str(row["steps"]),
                str(row["order"]), row["certainty"],
            )  # fmt: skip
        shown.add_section()
    return shown


def _law(costs: Case) -> str:
    slopes = costs["slopes"]
    return (
        f"seconds grow like digits^{slopes['digits']} (law: D² M(D), slope 2 to 3.6) and like "
        f"t^{slopes['time']} (law: 1, a little more where errors grow)"
    )


def picture(costs: Case, folder: Path) -> Path:
    """The picture as reference-costs.svg and .png in the folder; returns the path of the SVG."""
    slopes = costs["slopes"]
    panels = [
        _panel("Against digits", f"{costs['scene']}, t = {costs['digits'][0]['time']:g}",
               "certain digits", costs["digits"], "digits", slopes["digits"]),
        _panel("Against time", f"{costs['scene']}, {costs['times'][0]['digits']} digits",
               "t", costs["times"], "time", slopes["time"]),
    ]  # fmt: skip
    drawing = render(panels, SHEET, {})
    folder.mkdir(parents=True, exist_ok=True)
    for suffix, data in ((".png", drawing.png), (".svg", drawing.svg)):
        beside = folder / f"reference-costs{suffix}.new"
        beside.write_bytes(data)
        beside.replace(folder / f"reference-costs{suffix}")
    return folder / "reference-costs.svg"


def _panel(
    title: str, subtitle: str, xlabel: str, rows: Sequence[Case], by: str, slope: float | None
) -> Panel:
    points = [(row[by], row["seconds"]) for row in rows]

    def draw(axes: Axes) -> None:
        log_axis(axes, "x", log_limits(x for x, _ in points))
        log_axis(axes, "y", log_limits(y for _, y in points))
        end, top = points[-1]
        labels = [(end, top, "measured", BLUE)]
        if slope is not None:
            law = [top * (x / end) ** slope for x, _ in points]
            axes.plot([x for x, _ in points], law, color=MUTED, lw=0.9, ls=(0, (1, 1.6)))
            labels.append((end, top, f"slope {slope:g}", MUTED))
        axes.plot(*zip(*points, strict=True), color=BLUE, marker="o", ms=3.5, lw=1.1)
        end_labels(axes, labels)

    spoken = f"{title}: " + "; ".join(f"{x:g}: {y:.3g} seconds" for x, y in points)
    return Panel(title, f"seconds, {subtitle}", xlabel, spoken, draw)
