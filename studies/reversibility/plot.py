"""Plot of reversibility: the defect of a step back from the start of the step forth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..core.records import AtMost
from ..core.result import Result
from ..report.alike import shares
from ..report.canvas import Panel, Sheet, log_axis, log_limits, note, round_off
from ..report.labels import end_labels
from ..report.palette import INK, MUTED, Mark
from ..report.wording import scientific
from .records import Measured, Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Case = Result[Measured, AtMost, Row]
SHEET = Sheet(width=3.3, right=1.16)


def panel(title: str, cases: Sequence[Case], marks: dict[str, Mark], digits: int) -> Panel:
    """Return the panel of the defect of Φ₋ₕ ∘ Φₕ along a run, with limit and round-off unit."""

    def draw(axes: Axes) -> None:
        curves = [_points(case) for case in cases]
        points = [point for curve in curves for point in curve]
        if not points:
            note(axes, f"No points. {cases[0].reason}")
            return
        unit, last = round_off(digits), max(time for time, _ in points)
        limits = sorted({x for case in cases if (x := case.expected.limit)})
        floor = min([unit, *(value for _, value in points if value > 0)])
        values = [max(value, floor) for _, value in points]
        log_axis(axes, "y", log_limits([floor, unit, *limits, *values], 0.05))
        labels = [(last, unit, "round-off", MUTED)]
        axes.axhline(unit, color=MUTED, lw=0.6, ls=(0, (1, 1.6)))
        for limit in limits:
            axes.axhline(limit, color=INK, lw=0.7, ls=(0, (3, 2)))
            labels.append((last, limit, "limit", MUTED))
        for case, curve, share in zip(cases, curves, shares(axes, curves), strict=True):
            mark = marks[case.method]
            times, defects = zip(*((t, max(v, floor)) for t, v in curve), strict=True)
            style: dict[str, Any] = {"color": mark.colour, "marker": mark.marker, "clip_on": False}
            axes.plot(times, defects, **style, **share.line(mark, 0.9), **share.marks(3.2))
            words = f"{case.method}  {scientific(case.measured.defect, 0)}"
            words += "" if case.passed else f"\n({case.verdict})"
            labels.append((last, defects[-1], words, mark.colour))
        end_labels(axes, labels)

    spoken = f"{title}: defect of a step forth and back against time, {digits} digits."
    return Panel(title, "defect of Φ₋ₕ ∘ Φₕ", "time t", spoken, draw)


def _points(case: Case) -> list[tuple[float, float]]:
    return [(row.time, row.defect) for row in case.rows if row.defect is not None]
