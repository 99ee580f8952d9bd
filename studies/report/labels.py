"""Words beside the ends of lines, in place of a legend in a box."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, Any

from .palette import GRID, WORDS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

Place = tuple[float, float]
SIZE = 7.6  # of type
NEAR = 3.0  # points of type from a curve's end within which its leader may touch it


def end_labels(
    axes: Axes, labels: Sequence[tuple[float, float, str, str]], gap: float = 8.6, indent: float = 9
) -> None:
    """Write words (x, y, text, colour) right of the axes beside the line ends, without overlap.

    A leader line joins words to their end, unless it would cross a curve: then the colour tells.
    """
    if not labels:
        return
    figure: Any = axes.figure
    room = getattr(figure, "room", math.inf) - indent / 72
    labels = [(x, y, broken(figure, words, room, fontsize=SIZE), colour)
              for x, y, words, colour in labels]  # fmt: skip
    height = axes.bbox.height * 72 / axes.figure.dpi
    width = axes.bbox.width * 72 / axes.figure.dpi
    to_axes = axes.transData + axes.transAxes.inverted()
    ends = [to_axes.transform((x, y)) for x, y, _, _ in labels]
    starts = [(x * width + 3.5, min(max(y, 0.0), 1.0) * height) for x, y in ends]
    curves = [_in_points(axes, line) for line in axes.get_lines()]
    heights = [gap * (1 + words.count("\n")) for _, _, words, _ in labels]
    ask_height(axes, sum(heights) - 8)
    for k, spot in uncrossed(starts, heights, width + indent, (-4, height + 4)):
        _, _, words, colour = labels[k]
        start, where = starts[k], (width + indent, spot)
        points: dict[str, Any] = {"xycoords": "axes points", "annotation_clip": False}
        line = {"arrowstyle": "-", "color": GRID, "linewidth": 0.5, "shrinkA": 0, "shrinkB": 0}
        far = abs(where[1] - start[1]) > 2 or where[0] - start[0] > 12
        if far and not any(_meets((start, where), curve) for curve in curves):
            axes.annotate("", xy=start, xytext=(where[0] - 1.5, spot), arrowprops=line, **points)
        axes.annotate(
            words,
            xy=where,
            fontsize=SIZE,
            va="center_baseline" if "\n" not in words else "center",
            linespacing=1.05,
            color=WORDS.get(colour, colour),
            **points,
        )


def ask_height(axes: Axes, points: float) -> None:
    """Ask the sheet for axes of so many points of type at least (`canvas`)."""
    figure: Any = axes.figure
    figure.tall = max(getattr(figure, "tall", 0.0), points)


def broken(figure: Figure, words: str, room: float, **font: Any) -> str:
    """Return words in lines of at most so many inches, as far as spaces and colons allow."""
    if room == math.inf:
        return words
    text = figure.text(0, 0, "", **font)

    def fits(line: str) -> bool:
        text.set_text(line.strip())
        return bool(text.get_window_extent().width <= room * figure.dpi)

    lines = []
    for line in words.split("\n"):
        lines.append("")
        for part in re.findall(r"[^\s:]*(?::|\s+|$)", line):
            if lines[-1] and not fits(lines[-1] + part):
                lines.append("")
            lines[-1] += part
    text.remove()
    return "\n".join(line.strip() for line in lines)


def _in_points(axes: Axes, line: Line2D) -> Any:
    """Return the points of a line from the lower left corner of the axes, in points of type."""
    places: Any = line.get_path().transformed(line.get_transform()).vertices
    return (places - axes.bbox.p0) * 72 / axes.figure.dpi


def _meets(leader: tuple[Place, Place], curve: Any) -> bool:
    """True if a curve (points, 2) crosses a straight line beyond `NEAR` of its start."""
    import numpy as np

    start, end = (np.array(place) for place in leader)
    way = end - start
    start = start + way * min(NEAR / float(np.hypot(*way)), 1.0)

    def side(points: Any, at: Any, along: Any) -> Any:
        off = points - at
        return np.sign(along[..., 0] * off[..., 1] - along[..., 1] * off[..., 0])

    parts = np.diff(curve, axis=0)
    over = side(curve[:-1], start, way) * side(curve[1:], start, way) < 0
    return bool((over & (side(start, curve[:-1], parts) * side(end, curve[:-1], parts) < 0)).any())


def uncrossed(
    starts: Sequence[tuple[float, float]], heights: Sequence[float], right: float,
    ends: tuple[float, float],
) -> list[tuple[int, float]]:  # fmt: skip
    """Return (number, middle) of words at x = right, upwards, whose leader lines do not cross.

    ends: where the lowest begins and the highest ends. They stand in the order of their starts, but
    two whose lines cross change places, which makes both lines together shorter: so this comes to
    an end.
    """
    order = sorted(range(len(starts)), key=lambda k: (starts[k][1], -k))
    for _ in range(len(starts) ** 2 + 1):
        wished = [min(max(starts[k][1], ends[0]), ends[1]) for k in order]
        sizes = [heights[k] for k in order]
        low, high = ends[0] + sizes[0] / 2, ends[1] - sizes[-1] / 2
        placed = list(zip(order, spread(sorted(wished), sizes, low, high), strict=True))
        pairs = combinations(range(len(order)), 2)
        lines = [(starts[k], (right, y)) for k, y in placed]
        cross = (pair for pair in pairs if _cross(*(lines[k] for k in pair)))
        if (pair := next(cross, None)) is None:
            break
        low, high = pair
        order[low], order[high] = order[high], order[low]
    return placed


def _cross(one: Sequence[tuple[float, float]], other: Sequence[tuple[float, float]]) -> bool:
    """True if two lines to the right, (start, end), cross between their ends."""
    left = max(one[0][0], other[0][0])
    if left >= one[1][0]:
        return False

    def height(line: Sequence[tuple[float, float]]) -> float:
        (x, y), (x1, y1) = line
        return y + (y1 - y) * (left - x) / (x1 - x)

    return (height(one) - height(other)) * (one[1][1] - other[1][1]) < -1e-6


def spread(
    wished: Sequence[float], heights: Sequence[float], low: float, high: float
) -> list[float]:
    """Return middles nearest to the wished ones (ascending) for words of these heights, none
    touching.

    After the heights below each are subtracted, the middles only have to ascend: isotonic
    regression.
    """
    if not wished:
        return []
    import numpy as np
    from scipy.optimize import isotonic_regression

    below = np.cumsum([0.0, *((a + b) / 2 for a, b in pairwise(heights))])
    level = isotonic_regression(np.array(wished) - below).x
    return list(np.maximum(low, np.minimum(level, high - below[-1])) + below)
