"""Curves that coincide, drawn so that each is visible: alternating dashes, nested marks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .palette import PAPER, Mark

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Curve = Sequence[tuple[float, float]]
NEAR = 1.7  # distance in points of type below which curves look like one line
DASH = 4.5


@dataclass(frozen=True)
class Share:
    """The position of a curve among those that coincide with it, from the lowest upwards."""

    place: int = 0
    of: int = 1

    def line(self, mark: Mark, width: float) -> dict[str, Any]:
        """Return the style of the line: its own, or dashes that alternate with the others'."""
        if self.of == 1 or self.place == 0:
            return {"lw": width * (1 if self.of == 1 else 1.25), "ls": mark.dash}
        on, period = DASH / width, self.of * DASH / width
        dash = (period - self.place * on, (on, period - on))
        return {"lw": 1.25 * width, "ls": dash, "dash_capstyle": "butt"}

    def marks(self, usual: float) -> dict[str, Any]:
        """Return size and edge of filled marks: the lowest is largest, others have a light edge."""
        if self.of == 1:
            return {"ms": usual, "mew": 0.8}
        edge = {"mew": 0.8} if self.place == 0 else {"mew": 0.5, "mec": PAPER}
        return {"ms": usual + 0.6 + 2.4 * (self.of - 1 - self.place), **edge}


def shares(axes: Axes, curves: Sequence[Curve]) -> list[Share]:
    """Return the share of each curve; the axes must have their final limits and scales."""
    drawn = [_points(axes, curve) for curve in curves]
    groups: list[list[int]] = []
    for k, points in enumerate(drawn):
        near = (g for g in groups if _near(drawn[g[0]], points))
        group = next(near, None)
        if group is None:
            groups.append([k])
        else:
            group.append(k)
    place = {k: Share(i, len(group)) for group in groups for i, k in enumerate(group)}
    return [place[k] for k in range(len(curves))]


def _points(axes: Axes, curve: Curve) -> Any:
    """Return the places of a curve on the page in points of type, an array (points, 2)."""
    import numpy as np

    places = axes.transData.transform(np.reshape(curve, (-1, 2))) * 72 / axes.figure.dpi
    return places[np.isfinite(places).all(axis=1)]


def _near(one: Any, other: Any) -> bool:
    """Return True if nearly all points of the shorter curve lie on the line of the other."""
    import numpy as np

    short, long = sorted(
        (one, other), key=lambda points: float(np.ptp(points[:, 0]) if len(points) else 0.0)
    )
    if not len(short) or not len(long) or len(short) == 1 < len(long):
        return False  # a point on a line hides nothing of it
    starts, ways = long, np.diff(long, axis=0, append=long[-1:])
    beside = 0
    for point in short:
        along = ((point - starts) * ways).sum(axis=1) / np.maximum((ways**2).sum(axis=1), 1e-12)
        feet = starts + np.clip(along, 0, 1)[:, None] * ways
        beside += bool(((point - feet) ** 2).sum(axis=1).min() >= NEAR**2)
        if beside > 0.05 * len(short):
            return False
    return True
