"""The records of orders: of a ladder of runs, and of single steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Row:
    """A run of the ladder, with its errors relative to the state; without them it failed.

    why_not: the reason why it is not in the fit. round_off: the round-off of the run, if measured.
    """

    steps: int = 0
    step: float = 0.0
    error: float | None = None
    error_x: float | None = None
    error_mu: float | None = None
    used: bool = False
    why_not: str | None = None
    cause: str = ""
    multipliers: float | None = None
    round_off: float = 0.0


@dataclass(frozen=True, slots=True)
class Measured:
    """The slope of the window with its interval, of so many points; `why_not` if no other method
    knows the end."""

    order: float | None = None
    interval: Sequence[float] | None = None
    points: int | None = None
    multipliers: float | None = None
    effective: float | None = None
    why_not: str | None = None


@dataclass(frozen=True, slots=True)
class Expected:
    """The expected order and its tolerance; declared: the order in another chart."""

    order: float | None = None
    tolerance: float | None = None
    declared: float | None = None
    effective: float | None = None
