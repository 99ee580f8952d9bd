"""The picture of convergence: error against step size, one panel per scene with all its rules."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from ..core.result import AnyResult
from .alike import Share, shares
from .canvas import Panel, Sheet, log_axis, log_limits, note
from .labels import end_labels
from .palette import MUTED, PAPER, Mark
from .wording import order_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(width=3.2)
BELOW = ("round-off", "reference")  # why a point tells nothing of an order
Curve = list[tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Point:
    """A run of a ladder: its step, its error if it has one, and why it is not in the fit."""

    step: float | None = None
    error: float | None = None
    used: bool = False
    why_not: str | None = None

    @property
    def drawn(self) -> bool:
        """True if the point has a place on logarithmic axes."""
        return bool(self.step and self.error and self.error > 0)


@dataclass(frozen=True)
class Line:
    """The errors of a method on a ladder of steps, its order and the expected one.

    more: words beneath its name, such as the time at which its runs end.
    """

    case: AnyResult
    points: Sequence[Point]
    order: float | None = None
    expected: float | None = None
    more: str = ""

    @property
    def curve(self) -> Curve:
        """The points that are drawn, (step, error)."""
        points = [(abs(p.step), p.error) for p in self.points if p.drawn and p.step and p.error]
        return sorted(points)

    @property
    def fitted(self) -> Curve:
        """The part of the curve that the fit uses; all of it if that is no part."""
        used = sorted((abs(p.step), p.error) for p in self.points if p.used and p.step and p.error)
        return used if len(used) > 1 else self.curve

    @property
    def label(self) -> str:
        """The words at the end of the line."""
        words = self.case.method + (
            f"  {order_of(self.order, 3)}" if self.order is not None else ""
        )
        verdict = "" if self.case.passed else f"({self.case.verdict})"
        return "\n".join(filter(None, (words, self.more.strip(), verdict)))


def panel(
    title: str,
    lines: Sequence[Line],
    marks: dict[str, Mark],
    what: str = "error in (x, μ)",
    along: str = "step h",
) -> Panel:
    """Return the panel of one scene at one precision; what: the drawn quantity; along: x axis."""

    def draw(axes: Axes) -> None:
        curves = [line.curve for line in lines]
        everything = [point for curve in curves for point in curve]
        if not everything:
            note(axes, f"No points. {lines[0].case.reason if lines else ''}")
            return
        steps = [abs(point.step) for line in lines for point in line.points if point.step]
        log_axis(axes, "x", log_limits(steps, 0.06, 0.5), 4)
        log_axis(axes, "y", log_limits(error for _, error in everything))
        labels, fellows = [], dict[float, list[Curve]]()
        for line, curve, share in zip(lines, curves, shares(axes, curves), strict=True):
            mark = marks[line.case.method]
            _curve(axes, line, curve, mark, share)
            end = max(curve, default=(axes.get_xlim()[1], axes.get_ylim()[0]))
            labels.append((*end, line.label, mark.colour))
            if line.expected and any(point.why_not not in BELOW for point in line.points):
                fellows.setdefault(line.expected, []).append(line.fitted)
        slope_marks(axes, fellows, curves)
        end_labels(axes, labels)

    spoken = f"{title}: {what} against step size on logarithmic axes. "
    spoken += "; ".join(line.label for line in lines)
    return Panel(title, what, along, spoken, draw)


def _curve(axes: Axes, line: Line, points: Curve, mark: Mark, share: Share) -> None:
    """Draw the line, and each point with a mark that shows whether the fit used it."""
    if points:
        axes.plot(*zip(*points, strict=True), color=mark.colour, **share.line(mark, 0.9))
    kinds: dict[str, Curve] = {}
    for point in line.points:
        if point.step:
            why = "" if point.used else point.why_not or "left out"
            kind = why if point.drawn else "failed"
            kinds.setdefault(kind, []).append((abs(point.step), point.error or 0.0))
    for why, curve in kinds.items():
        style: dict[str, Any] = {"ls": "", "color": mark.colour, "zorder": 3}
        style |= {"marker": mark.marker, **share.marks(3.6)}
        if why == "failed":
            style |= {"marker": "|", "ms": 7, "transform": axes.get_xaxis_transform()}
            style |= {"clip_on": False, "mew": 1.4, "mec": mark.colour}
            curve = [(step, 1.0) for step, _ in curve]
        elif why in BELOW:
            style |= {"marker": "x", "mec": mark.colour, "mew": 0.8}
        elif why:
            style |= {"mfc": PAPER, "mec": mark.colour, "mew": 0.8}
        axes.plot(*zip(*curve, strict=True), **style)


def slope_marks(axes: Axes, fellows: dict[float, list[Curve]], curves: Sequence[Curve]) -> None:
    """Draw a triangle for each slope, clear of all curves, near those with that slope."""
    import numpy as np
    from scipy.spatial import KDTree

    taken = _along(axes, curves)
    decades_x, decades_y = (
        math.log10(high / low) for low, high in (axes.get_xlim(), axes.get_ylim())
    )
    for slope, kin in sorted(fellows.items()):
        width = min(0.17, 0.3 * decades_y / (slope * decades_x))
        height = slope * width * decades_x / decades_y
        outline = np.array(_outline(width, height))
        spots = np.mgrid[0.03 : 0.9 - width : 0.03, 0.08 : 0.94 - height : 0.03].reshape(2, -1).T

        def nearest(points: Curve, spots: Any = spots, outline: Any = outline) -> Any:
            return KDTree(points).query(spots[:, None] + outline)[0].min(axis=1)

        own = np.array(sorted(_along(axes, kin)))
        below = spots[:, 1] < np.interp(spots[:, 0] + width / 2, own[:, 0], own[:, 1])
        near = nearest(taken)
        wish = 2.0 - nearest(own.tolist()) + 0.3 * below
        best = int(np.argmax(np.where(near < 0.07, near, wish)))
        if near[best] < 0.04:
            continue
        x, y = (float(edge) for edge in spots[best])
        corners = [(x, y), (x + width, y), (x + width, y + height), (x, y)]
        style: dict[str, Any] = {"transform": axes.transAxes, "color": MUTED}
        axes.plot(*zip(*corners, strict=True), lw=0.6, **style)
        words: dict[str, Any] = {"fontsize": 6.8, **style}
        axes.text(x + width / 2, y - 0.015, "1", ha="center", va="top", **words)
        axes.text(x + width + 0.02, y + height / 2, f"{slope:g}", va="center", **words)
        taken += [(x + dx, y + dy) for dx, dy in outline.tolist()]


def _along(axes: Axes, curves: Sequence[Curve]) -> Curve:
    """Return many points along the curves, as fractions of the axes, and one far away."""
    to_axes = axes.transData + axes.transAxes.inverted()
    points = [(2.0, 2.0)]
    for curve in curves:
        for (x0, y0), (x1, y1) in pairwise(to_axes.transform(point) for point in curve):
            points += [(x0 + (x1 - x0) * k / 8, y0 + (y1 - y0) * k / 8) for k in range(9)]
    return points


def _outline(width: float, height: float) -> Curve:
    """Return points of a triangle and of its two numbers, from its left corner."""
    points = [(width * k / 4, -0.07 * (k % 2)) for k in range(5)]
    points += [(width * k / 4, height * k / 4) for k in range(5)]
    return [*points, (width + 0.07, height / 2), (width, height / 2)]
