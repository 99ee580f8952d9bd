"""The picture of convergence: error against step size, one panel per scene with all its rules."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from .alike import Share, shares
from .canvas import Panel, Sheet, log_axis, log_limits, note
from .labels import end_labels
from .palette import MUTED, PAPER, Mark
from .wording import Case, mapping, number, rows, rule_name, verdict

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET = Sheet(width=3.2)
Curve = list[tuple[float, float]]


def panel(
    title: str,
    cases: Sequence[Case],
    marks: dict[str, Mark],
    what: str = "error in (x, μ)",
    along: str = "step h",
) -> Panel:
    """Return the panel of one scene at one precision; what: the drawn quantity; along: x axis."""

    def draw(axes: Axes) -> None:
        curves = {rule_name(case): _points(case) for case in cases}
        everything = [point for curve in curves.values() for point in curve]
        if not everything:
            reasons = " ".join(str(case.get("reason") or "") for case in cases[:1])
            note(axes, f"No points. {reasons}")
            return
        steps = [step for case in cases for row in rows(case) if (step := _step(row))]
        log_axis(axes, "x", log_limits(steps, 0.06, 0.5), 4)
        log_axis(axes, "y", log_limits(error for _, error in everything))
        labels = []
        for case, share in zip(cases, shares(axes, list(curves.values())), strict=True):
            curve, mark = curves[rule_name(case)], marks[rule_name(case)]
            _curve(axes, case, mark, share)
            end = max(curve, default=(axes.get_xlim()[1], axes.get_ylim()[0]))
            labels.append((*end, _label(case), mark.colour))
        fellows: dict[float, list[Curve]] = {}
        for case in cases:
            if order := number(mapping(case, "expected").get("order")):
                fellows.setdefault(order, []).append(curves[rule_name(case)])
        slope_marks(axes, fellows, list(curves.values()))
        end_labels(axes, labels)

    spoken = f"{title}: {what} against step size on logarithmic axes. "
    spoken += "; ".join(_label(case) for case in cases)
    return Panel(title, what, along, spoken, draw)


def _label(case: Case) -> str:
    order = number(mapping(case, "measured").get("order"))
    words = rule_name(case) + (f"  {order:.3f}" if order is not None else "")
    return words if verdict(case) == "pass" else f"{words}\n({verdict(case)})"


def _step(row: dict[str, Any]) -> float | None:
    step = number(row.get("step"))
    return abs(step) if step else None


def _points(case: Case) -> Curve:
    found = [(_step(row), number(row.get("error"))) for row in rows(case)]
    return sorted((step, error) for step, error in found if step and error and error > 0)


def _curve(axes: Axes, case: Case, mark: Mark, share: Share) -> None:
    """Draw the line, and each point with a mark that shows whether the fit used it."""
    points = _points(case)
    if points:
        axes.plot(*zip(*points, strict=True), color=mark.colour, **share.line(mark, 0.9))
    kinds: dict[str, Curve] = {}
    for row in rows(case):
        step, error = _step(row), number(row.get("error"))
        why = "" if row.get("used") else str(row.get("why_not") or "left out")
        if step is not None:
            failed = error is None or error <= 0
            kinds.setdefault("failed" if failed else why, []).append((step, error or 0.0))
    for why, curve in kinds.items():
        style: dict[str, Any] = {"ls": "", "color": mark.colour, "zorder": 3}
        style |= {"marker": mark.marker, **share.marks(3.6)}
        if why == "failed":
            style |= {"marker": "|", "ms": 7, "transform": axes.get_xaxis_transform()}
            style |= {"clip_on": False, "mew": 1.4, "mec": mark.colour}
            curve = [(step, 1.0) for step, _ in curve]
        elif why in ("round-off", "reference"):
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
    found = [(2.0, 2.0)]
    for curve in curves:
        for (x0, y0), (x1, y1) in pairwise(to_axes.transform(point) for point in curve):
            found += [(x0 + (x1 - x0) * k / 8, y0 + (y1 - y0) * k / 8) for k in range(9)]
    return found


def _outline(width: float, height: float) -> Curve:
    """Return points of a triangle and of its two numbers, from its left corner."""
    points = [(width * k / 4, -0.07 * (k % 2)) for k in range(5)]
    points += [(width * k / 4, height * k / 4) for k in range(5)]
    return [*points, (width + 0.07, height / 2), (width, height / 2)]
