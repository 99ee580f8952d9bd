"""Words beside the ends of lines, in place of a legend in a box."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from .palette import GRID, WORDS

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def end_labels(
    axes: Axes, labels: Sequence[tuple[float, float, str, str]], gap: float = 8.6, indent: float = 9
) -> None:
    """Write words (x, y, text, colour) right of the axes beside the line ends, without overlap."""
    if not labels:
        return
    height = axes.bbox.height * 72 / axes.figure.dpi
    width = axes.bbox.width * 72 / axes.figure.dpi
    to_axes = axes.transData + axes.transAxes.inverted()
    ends = [to_axes.transform((x, y)) for x, y, _, _ in labels]
    order = sorted(range(len(labels)), key=lambda k: (ends[k][1], -k))
    wished = [min(max(ends[k][1], 0.0), 1.0) * height for k in order]
    heights = [gap * (1 + labels[k][2].count("\n")) for k in order]
    for k, spot in zip(order, spread(wished, heights, -4, height + 4), strict=True):
        _, _, words, colour = labels[k]
        start = (ends[k][0] * width + 3.5, min(max(ends[k][1], 0.0), 1.0) * height)
        where = (width + indent, spot)
        points: dict[str, Any] = {"xycoords": "axes points", "annotation_clip": False}
        line = {"arrowstyle": "-", "color": GRID, "linewidth": 0.5, "shrinkA": 0, "shrinkB": 0}
        if abs(where[1] - start[1]) > 2 or where[0] - start[0] > 12:
            axes.annotate("", xy=start, xytext=(where[0] - 1.5, spot), arrowprops=line, **points)
        axes.annotate(
            words,
            xy=where,
            fontsize=7.6,
            va="center_baseline" if "\n" not in words else "center",
            linespacing=1.05,
            color=WORDS.get(colour, colour),
            **points,
        )


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
