"""The work-precision diagram: error against work, one panel a race, all methods in it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..core.records import AtMost
from ..core.result import Result
from ..report.alike import Share, shares
from ..report.canvas import Panel, Sheet, log_axis, log_limits, note
from ..report.labels import end_labels
from ..report.palette import INK, MUTED, Mark
from ..report.wording import scientific
from .records import ERRORS, WORK, Measured, Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Case = Result[Measured, AtMost, Row]
FLOOR = "rounded start"  # name of the floor's line: the error that rounding the start makes
SHEET = Sheet(width=3.5, height=2.75, right=1.0)
Point = tuple[float, float, Row]


def panel(title: str, cases: Sequence[Case], marks: dict[str, Mark]) -> Panel:
    """Return the panel of one race; the axes are those of the race."""
    measured = cases[0].measured
    x, y = measured.x or "seconds", measured.y or "error"

    def draw(axes: Axes) -> None:
        curves = {case.method: _points(case, x, y) for case in cases}
        everything = [point for curve in curves.values() for point in curve]
        if not everything:
            note(axes, f"No points. {cases[0].reason}")
            return
        floor = (cases[0].details.floor or {}).get(y)
        log_axis(axes, "x", log_limits((work for work, _, _ in everything), 0.05), 5)
        log_axis(axes, "y", log_limits([e for _, e, _ in everything] + [floor or 1.0], 0.05), 6)
        labels = []
        if floor:
            axes.axhline(floor, color=INK, lw=0.7, ls=(0, (3, 2)))
            labels.append((axes.get_xlim()[1], floor, FLOOR, MUTED))  # beside, where no curve is
        for crossing in cases[0].details.crossovers if x == "seconds" else ():
            ring: dict[str, Any] = {"ms": 8, "mfc": "none", "mec": INK, "mew": 0.8, "zorder": 4}
            axes.plot(crossing.work, crossing.error, ls="", marker="o", **ring)
        lines = [[point[:2] for point in curves[case.method]] for case in cases]
        for case, share in zip(cases, shares(axes, lines), strict=True):
            curve, mark = curves[case.method], marks[case.method]
            if not curve:
                continue
            _curve(axes, curve, mark, share, x)
            if case.measured.cut:
                _going_on(axes, curve, mark)
            words = case.method.replace(":", ":\n")
            words += "" if case.passed else f"\n({case.verdict})"
            labels.append((*curve[-1][:2], words, mark.colour))
        end_labels(axes, labels)

    spoken = f"{title}: {ERRORS.get(y, y)} against {WORK.get(x, x)} on logarithmic axes. "
    spoken += "; ".join(case.method for case in cases)
    return Panel(title, ERRORS.get(y, y) + _standing(cases), WORK.get(x, x), spoken, draw)


def _standing(cases: Sequence[Case]) -> str:
    """Return in words whether the fastest rule and the fastest peer change places."""
    stand, changes = cases[0].details.standing, cases[0].details.crossovers
    if stand is None or changes:
        said = "crossovers are ringed" if changes else "no accuracy is reached by both"
        return f"; {said}" if len({case.details.kind for case in cases}) > 1 else ""
    span = f"from {scientific(stand.loosest)} to {scientific(stand.tightest)}"
    if stand.sure:
        return f"; no crossover: {stand.leader}s lead {span}"
    leads = f"{stand.leader}s lead" if stand.leader else "neither leads"
    return f"; {leads} {span}, in part by less than runs differ"


def _going_on(axes: Axes, curve: list[Point], mark: Mark) -> None:
    """Draw an arrow at the end of a ladder that the budget ended."""
    to_pixels = axes.transData
    ends = to_pixels.transform([point[:2] for point in curve[-2:]])
    way = ends[-1] - ends[0] if len(curve) > 1 else ends[0] * 0 + (1.0, -1.0)
    length = float((way**2).sum()) ** 0.5 or 1.0
    end = ends[-1] + way / length * axes.figure.dpi / 72 * 11
    head: Any = to_pixels.inverted().transform(end)
    drawn: dict[str, Any] = {"arrowstyle": "->,head_width=0.15,head_length=0.25", "lw": 0.9}
    drawn |= {"color": mark.colour, "shrinkA": 2.5, "shrinkB": 0}
    axes.annotate(
        "", xy=head, xytext=curve[-1][:2], arrowprops=drawn, annotation_clip=False, zorder=2.5
    )


def _points(case: Case, x: str, y: str) -> list[Point]:
    """Return (work, error, row) in the order of the ladder; an error of zero cannot be drawn."""
    points = [(row.along(x), row.along(y), row) for row in case.rows]
    return [(work, error, row) for work, error, row in points if work and error and error > 0]


def _curve(axes: Axes, curve: list[Point], mark: Mark, share: Share, x: str) -> None:
    """Draw the line, its marks and the quartiles of times; a stroke ends those with outliers."""
    style: dict[str, Any] = {"color": mark.colour, "zorder": 2.5}
    line = [*zip(*(point[:2] for point in curve), strict=True)]
    axes.plot(*line, **share.line(mark, 0.9), **style)
    if x == "seconds":
        for _, error, row in curve:
            if (low := row.seconds_low) and (high := row.seconds_high):
                axes.plot([low, high], [error, error], lw=2.2, alpha=0.4, **style)
                if row.outliers:
                    axes.plot([high], [error], ls="", marker="|", ms=4.5, mew=0.8, **style)
    look = {"mec": mark.colour, "mfc": mark.face, **share.marks(3.2)}
    axes.plot(*line, ls="", marker=mark.marker, **look, **style)
