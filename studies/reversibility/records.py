"""The records of steps forth and back."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Row:
    """The distance from the start after a step forth and back, at a time of the run."""

    time: float | None = None
    defect: float | None = None


@dataclass(frozen=True, slots=True)
class Measured:
    """The largest of these."""

    defect: float | None = None


@dataclass(frozen=True, slots=True)
class Expected:
    """The largest that round-off leaves."""

    limit: float | None = None
