"""The records of runs through several charts."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Row:
    """A run from a first step of so many turns about an axis; None if the axis was drawn.

    The largest defect of each kind along it, and the angle of the step in one chart, in turns.
    """

    turn: float = 0.0
    axis: int | None = None
    residual: float | None = None
    pullback: float | None = None
    poisson: float | None = None
    momentum: float | None = None
    distance: float | None = None
    chart_turn: float | None = None
    newton_max: float | None = None
    newton_mean: float | None = None
