"""The records of the energy along a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Row:
    """The error of the energy at a time, over the energy that moves."""

    time: float | None = None
    error: float | None = None


@dataclass(frozen=True, slots=True)
class Measured:
    """The band of the error, its slope per unit of time, the slopes of its edges, and the drift.

    balance_order: under a force the order of energy less work, None if that does not sink.
    """

    band: float | None = None
    slope: float | None = None
    slope_interval: Sequence[float] | None = None
    edge_slopes: Sequence[float] | None = None
    drift: float | None = None
    balance_order: float | None = None


@dataclass(frozen=True, slots=True)
class Expected:
    """The largest slope, or the least order of energy less work, or why nothing is demanded."""

    slope_limit: float | None = None
    balance_order: float | None = None
    not_demanded: str | None = None
