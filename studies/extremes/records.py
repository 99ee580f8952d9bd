"""The records of runs at the edge of a scene."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Found:
    """The outcome of a run, its error, and the sign by which a failure was noticed."""

    outcome: str | None = None
    error: float | None = None
    noticed: str | None = None
    message: str | None = None


@dataclass(frozen=True, slots=True)
class Row:
    """A run at the edge of a scene: its hω, outcome and error, and the sign of a failure.

    estimate: the difference from runs with smaller steps.
    """

    z: float = 0.0
    outcome: str = ""
    error: float | None = None
    estimate: float | None = None
    noticed: str = ""


@dataclass(frozen=True, slots=True)
class Measured:
    """The runs with a step that resolves the fastest motion, and with one that does not."""

    fine: Found | None = None
    coarse: Found | None = None
