"""Plots of charts: the rotations asked for and made by runs, and the ball of rotations."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from discmech.studies.core.result import Result
from discmech.studies.report.canvas import Panel, Sheet, log_axis
from discmech.studies.report.palette import BLUE, GREEN, GRID, INK, MUTED, ORANGE, SKY, VERMILLION

from .records import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Case = Result[dict[str, Any], dict[str, Any], Row]
SHEET = Sheet(width=3.3, height=2.75, left=0.62, right=0.28, columns=2)
TINTS = (BLUE, ORANGE, GREEN, SKY)
DEFECTS = {"residual": (VERMILLION, "o"), "pullback": (BLUE, "s"), "poisson": (GREEN, "^"),
           "momentum": (MUTED, "x"), "distance": (ORANGE, "+")}  # fmt: skip
CORRECTIONS = {"newton_max": (MUTED, "x"), "newton_mean": (BLUE, "o")}
STROKES = "x+"  # markers that are lines


def panels(title: str, case: Case) -> list[Panel]:
    return [_rotations(title, case), _ball(case), _defects(case), _corrections(case)]


def _points(case: Case, name: str) -> list[tuple[float, float]]:
    found: list[tuple[float, float | None]] = [(r.turn, getattr(r, name)) for r in case.rows]
    return [(turn, value) for turn, value in found if value is not None]


def _columns(points: list[tuple[float, float]]) -> tuple[list[float], list[float]]:
    return [a for a, _ in points], [b for _, b in points]


def _across(axes: Axes) -> None:
    axes.set_xlim(0, 1)
    axes.set_xticks([0, 0.25, 0.5, 0.75, 1], labels=["0", "¼", "½", "¾", "1"])
    axes.grid(visible=True, color=GRID, linewidth=0.4)
    axes.set_axisbelow(True)


def _rotations(title: str, case: Case) -> Panel:
    bound = _points(case, "chart_turn")

    def draw(axes: Axes) -> None:
        _across(axes)
        axes.set_ylim(0, 0.55)
        axes.plot([0, 0.5, 1], [0, 0.5, 0], color=BLUE, lw=1.1)
        curve = [k / 100 for k in range(101)]
        axes.plot(curve, [math.atan(math.pi * t) / math.pi for t in curve],
                  color=MUTED, lw=0.8, ls=(0, (1, 1.6)))  # fmt: skip
        if bound:
            axes.scatter(*_columns(bound), s=7, color=VERMILLION, lw=0)
        axes.text(0.53, 0.49, "on the group", fontsize=7, color=BLUE)
        axes.text(0.99, 0.43, "τ(hu) of the spin", fontsize=7, color=MUTED, ha="right")
        axes.text(0.4, 0.15, "bound to one chart", fontsize=7, color=VERMILLION)

    spoken = "Angle of the first step against the rotation asked for, on the group and in one chart"
    return Panel(title, "angle of a step, in turns", "rotation asked for, in turns", spoken, draw)


def _ball(case: Case) -> Panel:
    found = case.details.slice

    def draw(axes: Axes) -> None:
        import numpy as np

        if not found:
            return
        at = found["across"]
        det = np.array([[math.nan if e is None else e for e in row] for row in found["det"]])
        best = np.array([[math.nan if e is None else e for e in row] for row in found["best"]])
        for k, tint in enumerate(TINTS):
            axes.contourf(at, at, 1.0 * (best == k), levels=[0.5, 1.5], colors=[tint], alpha=0.22)
        axes.contour(at, at, det, levels=[0], colors=[INK], linewidths=1.1)
        circle = [2 * math.pi * k / 200 for k in range(201)]
        axes.plot([math.cos(a) / 2 for a in circle], [math.sin(a) / 2 for a in circle],
                  color=MUTED, lw=0.8, ls=(0, (1, 1.6)))  # fmt: skip
        starts = [_place(case, row) for row in case.rows if row.axis is not None]
        if starts:
            axes.scatter(*_columns(starts), s=4, color=INK, lw=0)
        for k in range(len(TINTS)):
            _named(axes, k, np.argwhere((best == k) & (np.array(at)[:, None] > 0)), at)
        axes.set_aspect("equal")
        axes.set_xlim(-0.53, 0.53)
        axes.set_ylim(-0.53, 0.53)

    return Panel("The ball of rotations", "a plane of rotation vectors, in turns", "",
                 "Translates that hold each rotation best, and the lines where FL is singular",
                 draw)  # fmt: skip


def _named(axes: Axes, k: int, cells: Any, at: Any) -> None:
    """Write a translate's number in the middle of the region where it is best (upper half disc)."""
    if len(cells):
        row, column = cells.mean(axis=0)
        step = at[1] - at[0]
        place = at[0] + step * column, at[0] + step * row
        disc = {"boxstyle": "circle,pad=0.15", "fc": "white", "lw": 0}
        name = "e" if k == 0 else str(k)
        axes.text(*place, name, fontsize=7, color=INK, ha="center", va="center", bbox=disc)


def _place(case: Case, row: Row) -> tuple[float, float]:
    """Return the place of a start in the disc: beyond half a turn on the other side."""
    axes = 1 + max(r.axis or 0 for r in case.rows)
    angle = math.pi * (row.axis or 0) / axes
    size = row.turn if row.turn <= 0.5 else row.turn - 1
    return size * math.cos(angle), size * math.sin(angle)


def _marked(
    axes: Axes, case: Case, series: dict[str, tuple[str, str]], limits: tuple[float, float]
) -> None:
    """Draw a run's numbers on a log axis, by name (colour, marker); zeros at its lower end."""
    _across(axes)
    log_axis(axes, "y", limits)
    _across(axes)
    for name, (colour, marker) in series.items():
        points = [(t, max(v, limits[0])) for t, v in _points(case, name)]
        if points:
            axes.scatter(*_columns(points), s=8, color=colour, marker=marker,
                         lw=0.6 if marker in STROKES else 0,
                         label=name.removeprefix("newton_"))  # fmt: skip


def _defects(case: Case) -> Panel:
    def draw(axes: Axes) -> None:
        _marked(axes, case, DEFECTS, (1e-18, 1e-12))
        axes.axhline(2.0**-53, color=MUTED, lw=0.7, ls=(0, (1, 1.6)))
        axes.legend(loc="upper left", ncols=2, fontsize=6.5, frameon=False, handletextpad=0.1)

    about = "worst of each run; dotted: one unit of round-off"
    across = "rotation of the first step, in turns"
    return Panel("Defects", about, across, "Defects against rotation", draw)


def _corrections(case: Case) -> Panel:
    def draw(axes: Axes) -> None:
        _marked(axes, case, CORRECTIONS, (0.8, 120))
        axes.legend(loc="upper left", fontsize=6.5, frameon=False, handletextpad=0.1)

    return Panel("Newton corrections", "a step", "rotation of the first step, in turns",
                 "Newton corrections against rotation", draw)  # fmt: skip
