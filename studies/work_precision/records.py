"""The records of races."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..core.records import SPREAD, Json, number


@dataclass(frozen=True, slots=True)
class Row:
    """A run: its time with its quartiles, its other work and its errors, or the cause why not.

    values: by their names, such as steps and error-max (`axes`). promised: the error that was asked
    for by a tolerance.
    """

    seconds: float | None = None
    seconds_low: float | None = None
    seconds_high: float | None = None
    outliers: int | None = None
    tolerance: float | None = None
    promised: float | None = None
    cause: str | None = None
    values: Json = field(default_factory=dict, metadata=SPREAD)

    def along(self, axis: str) -> float | None:
        """Return the value of an axis, such as seconds or error-max."""
        return self.seconds if axis == "seconds" else number(self.values.get(axis))


@dataclass(frozen=True, slots=True)
class Measured:
    """The axes of a race, the smallest error, and by accuracy the cost and its ratio to a peer's.

    cut: why the ladder ended. setup: the seconds to derive and compile.
    """

    x: str | None = None
    y: str | None = None
    best: float | None = None
    cost: Mapping[str, float | None] = field(default_factory=dict)
    ratio: Mapping[str, float | None] = field(default_factory=dict)
    cut: str | None = None
    setup: float | None = None
