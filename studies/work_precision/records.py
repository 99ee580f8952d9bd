"""The records of races."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Row:
    """A run: its work in all measures, its errors in all norms, or the cause why it has none.

    promised: the error that was asked for by a tolerance.
    """

    seconds: float | None = None
    seconds_low: float | None = None
    seconds_high: float | None = None
    outliers: int | None = None
    steps: float | None = None
    evaluations: float | None = None
    iterations: float | None = None
    error: float | None = None
    error_x: float | None = field(default=None, metadata={"key": "error-x"})
    error_mu: float | None = field(default=None, metadata={"key": "error-mu"})
    error_max: float | None = field(default=None, metadata={"key": "error-max"})
    error_x_max: float | None = field(default=None, metadata={"key": "error-x-max"})
    error_mu_max: float | None = field(default=None, metadata={"key": "error-mu-max"})
    energy: float | None = None
    energy_max: float | None = field(default=None, metadata={"key": "energy-max"})
    momentum: float | None = None
    momentum_max: float | None = field(default=None, metadata={"key": "momentum-max"})
    tolerance: float | None = None
    promised: float | None = None
    cause: str | None = None

    def along(self, axis: str) -> float | None:
        """Return the value of an axis, such as seconds or error-max."""
        value: float | None = getattr(self, axis.replace("-", "_"))
        return value


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
