"""The work-precision diagram: error against work, one panel a race, all methods in it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from ..core.records import AtMost
from ..report.canvas import Panel, Sheet, log_axis, log_limits, note
from ..report.case import Case as Shown
from ..report.labels import end_labels
from ..report.palette import INK, MUTED, PAPER, Mark
from .records import Measured, Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Case = Shown[Measured, AtMost, Row]
FLOOR = "rounding of the start"  # name of the floor's line
SHEET = Sheet(width=3.5, height=2.75, right=1.0)
WORK = {
    "seconds": "run time in seconds",
    "steps": "steps",
    "evaluations": "evaluations of the right-hand side or the kernel",
    "iterations": "Newton iterations",
}
ERRORS = {
    "error": "error in (x, μ) at the end",
    "error-x": "error in x at the end",
    "error-mu": "error in μ at the end",
    "error-max": "largest error in (x, μ)",
    "error-x-max": "largest error in x",
    "error-mu-max": "largest error in μ",
    "energy": "energy error at the end",
    "energy-max": "largest energy error",
    "momentum": "drift of the momenta at the end",
    "momentum-max": "largest drift of the momenta",
}
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
        floor = (cases[0].floor or {}).get(y)
        log_axis(axes, "x", log_limits((work for work, _, _ in everything), 0.05), 5)
        log_axis(axes, "y", log_limits([e for _, e, _ in everything] + [floor or 1.0], 0.05), 6)
        labels = []
        if floor:
            axes.axhline(floor, color=INK, lw=0.7, ls=(0, (3, 2)))
            axes.annotate(
                FLOOR, (_clear(axes, curves.values(), floor), floor), (2, 2), fontsize=6.4,
                xycoords=axes.get_yaxis_transform(), textcoords="offset points",
                ha="left", va="bottom", color=MUTED,
            )  # fmt: skip
        for crossing in cases[0].crossovers if x == "seconds" else ():
            ring: dict[str, Any] = {"ms": 8, "mfc": "none", "mec": INK, "mew": 0.8, "zorder": 4}
            axes.plot(crossing.work, crossing.error, ls="", marker="o", **ring)
        for case in cases:
            curve, mark = curves[case.method], marks[case.method]
            if not curve:
                continue
            _curve(axes, curve, mark, x)
            words = case.method.replace(":", ":\n")
            words += "" if case.passed else f"\n({case.verdict})"
            labels.append((*curve[-1][:2], words, mark.colour))
        end_labels(axes, labels)

    spoken = f"{title}: {ERRORS.get(y, y)} against {WORK.get(x, x)} on logarithmic axes. "
    spoken += "; ".join(case.method for case in cases)
    return Panel(title, ERRORS.get(y, y), WORK.get(x, x), spoken, draw)


def _clear(axes: Axes, curves: Iterable[list[Point]], floor: float) -> float:
    """Return the share of the floor's line at which its label touches no curve, or the left end."""
    import numpy as np

    to_axes = axes.transData + axes.transAxes.inverted()
    points = 72 / axes.figure.dpi
    wide, high = 66 / (axes.bbox.width * points), 12 / (axes.bbox.height * points)
    low = to_axes.transform((1.0, floor))[1]
    near = []
    for curve in curves:
        ends = to_axes.transform([point[:2] for point in curve]) if curve else np.empty((0, 2))
        for a, b in pairwise(ends):
            along = a + (b - a) * np.linspace(0, 1, 200)[:, None]
            near += [x for x, y in along if low - high / 3 <= y <= low + high]
    spots = np.linspace(0, 1 - wide, 40)
    return float(next((x for x in spots if not any(x - 0.02 < e < x + wide for e in near)), 0.0))


def _points(case: Case, x: str, y: str) -> list[Point]:
    """Return (work, error, row) in the order of the ladder; an error of zero cannot be drawn."""
    found = [(row.along(x), row.along(y), row) for row in case.rows]
    return [(work, error, row) for work, error, row in found if work and error and error > 0]


def _curve(axes: Axes, curve: list[Point], mark: Mark, x: str) -> None:
    """Draw the line, the quartiles of the times, and hollow marks for runs with outliers."""
    style: dict[str, Any] = {"color": mark.colour, "zorder": 2.5}
    axes.plot(*zip(*(point[:2] for point in curve), strict=True), lw=0.9, ls=mark.dash, **style)
    if x == "seconds":
        for _, error, row in curve:
            if (low := row.seconds_low) and (high := row.seconds_high):
                axes.plot([low, high], [error, error], lw=2.2, alpha=0.4, **style)
    for odd in (False, True):
        chosen = [p[:2] for p in curve if bool(x == "seconds" and p[2].outliers) is odd]
        if chosen:
            face: dict[str, Any] = {"mfc": PAPER} if odd else {}
            axes.plot(*zip(*chosen, strict=True), ls="", marker=mark.marker, ms=3.2, mew=0.7,
                      mec=mark.colour, **face, **style)  # fmt: skip
