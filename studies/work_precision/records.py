"""The records of races."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..core.records import SPREAD, Json, number

#: the axes of a work-precision diagram and their words: work, and relative errors
#: (`accuracy.Yardstick`)
WORK = {
    "seconds": "run time in seconds",
    "steps": "steps",
    "evaluations": "evaluations of the right-hand side or the kernel",
    "iterations": "Newton iterations",
}
ERRORS = {
    "error": "error in (x, μ) at the end",
    "error-x": "error in x at the end",
    "error-mu": "error in μ at the end",
    "error-max": "largest error in (x, μ)",
    "error-x-max": "largest error in x",
    "error-mu-max": "largest error in μ",
    "energy": "energy error at the end",
    "energy-max": "largest energy error",
    "momentum": "drift of the momenta at the end",
    "momentum-max": "largest drift of the momenta",
}


@dataclass(frozen=True, slots=True)
class Row:
    """A run: its time with its quartiles, its other work and its errors, or the cause why not.

    values: by their names, such as steps and error-max. promised: the error that was asked for by a
    tolerance.
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
