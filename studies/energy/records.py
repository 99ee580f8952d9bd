"""The records of the energy along a run."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ..core.records import OPTIONAL
from ..core.single_steps import SingleSteps
from ..systems.modified_change import Change

NOT_BACK = (
    "the energy goes one way, and so it may with a part of the motion that has not come back: take "
    "more --steps."
)


@dataclass(frozen=True, slots=True)
class Row:
    """The error of the energy at a time, over the energy that moves."""

    time: float | None = None
    error: float | None = None


@dataclass(frozen=True, slots=True)
class Measured:
    """The band of the error, its slope per unit of time, the slopes of its edges, and the drift.

    balance_order: under a force the order of energy less work, not a number if that does not sink.
    """

    band: float | None = None
    slope: float | None = None
    slope_interval: Sequence[float] | None = None
    edge_slopes: Sequence[float] | None = None
    balance_order: float | None = field(default=None, metadata=OPTIONAL)
    drift: float | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True)
class Beside:
    """The changes along a short run from a place (x, μ) beside the motion, and their band.

    errors: of a program's run in place of the rows, as a `Found` of its own.
    """

    place: Sequence[float] = ()
    step: float = 0.0
    band: float = 0.0
    rows: Sequence[Change] = ()
    errors: Any = field(default=None, metadata=OPTIONAL)

    def __str__(self) -> str:
        place = ", ".join(f"{e:.4g}" for e in self.place)
        return f"beside the motion, from (x, μ) = ({place}) with the step {self.step:.4g}"


@dataclass(frozen=True, slots=True)
class Found:
    """The error of the energy along the last run, to a time `duration`.

    steady: the way of its mean over the length of its path. quarters: the bands of the quarters of
    the run. drifts: the certain ones, (duration, slope, low, high), one per run. still: True if the
    motion comes to rest; turns: how often a coordinate turns. modified, beside: changes of the
    modified energy. slopes: those of ever longer runs. lost: the drift that lost digits explain.
    balance_orders, way, steps: of energy less work; alone: the motion without its force; before:
    a run of half as many steps, where the error comes late.
    """

    rows: Sequence[Row] = ()
    measured: Measured = field(default_factory=Measured)
    steady: float | None = field(default=None, metadata=OPTIONAL)
    quarters: Sequence[float] | None = field(default=None, metadata=OPTIONAL)
    drifts: Sequence[Sequence[float]] | None = field(default=None, metadata=OPTIONAL)
    duration: float = 0.0
    still: bool | None = field(default=None, metadata=OPTIONAL)
    turns: int | None = field(default=None, metadata=OPTIONAL)
    modified: Sequence[Change] | None = field(default=None, metadata=OPTIONAL)
    beside: Sequence[Beside] | None = field(default=None, metadata=OPTIONAL)
    slopes: Sequence[float] | None = field(default=None, metadata=OPTIONAL)
    lost: float | None = field(default=None, metadata=OPTIONAL)
    balance_orders: Sequence[float] | None = field(default=None, metadata=OPTIONAL)
    way: float | None = field(default=None, metadata=OPTIONAL)
    steps: int | None = field(default=None, metadata=OPTIONAL)
    alone: Any = field(default=None, metadata=OPTIONAL)
    before: Any = field(default=None, metadata=OPTIONAL)
    local: SingleSteps | None = None

    @property
    def band(self) -> float:
        """The band of the error."""
        return math.nan if self.measured.band is None else self.measured.band

    @property
    def slope(self) -> float:
        """The slope of the error."""
        return math.nan if self.measured.slope is None else self.measured.slope


@dataclass(frozen=True, slots=True)
class Expected:
    """The largest slope, or the least order of energy less work."""

    slope_limit: float | None = None
    balance_order: float | None = None
