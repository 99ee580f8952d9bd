"""The records of orders: of a ladder of runs, and of single steps."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from ..core.records import OPTIONAL
from ..core.single_steps import SingleSteps

#: the cause of a failed run whose end is too far away for a number, or is none
BLEW_UP = "it blew up: its error is no finite number"


@dataclass(frozen=True, slots=True)
class Row:
    """A run of the ladder, with its errors relative to the state; without them it failed.

    why_not: the reason why it is not in the fit. multipliers: their error, not a number if a step
    back fails. round_off: that of the run, if it was measured.
    """

    steps: int = 0
    step: float = 0.0
    error: float | None = None
    error_x: float | None = None
    error_mu: float | None = None
    used: bool = False
    why_not: str = ""
    cause: str | None = field(default=None, metadata=OPTIONAL)
    multipliers: float | None = field(default=None, metadata=OPTIONAL)
    round_off: float | None = field(default=None, metadata=OPTIONAL)

    def with_errors(self, error: float | None, of_x: float | None, of_mu: float | None) -> Row:
        """Return the row with the errors of (x, μ), of x and of μ."""
        if error is not None and not math.isfinite(error):
            return replace(self, why_not="failed", cause=BLEW_UP)
        return replace(self, error=error, error_x=of_x, error_mu=of_mu)


@dataclass(frozen=True, slots=True)
class Measured:
    """The slope of the window with its interval, of so many points.

    multipliers: the slope of their errors, not a number without one. why_not: the reason why no
    other method knows the end, so that errors are against own runs (`held_against`), and the digits
    that are known then. effective: the processed order, which the judge adds.
    """

    order: float | None = None
    interval: Sequence[float] | None = None
    points: int | None = None
    multipliers: float | None = field(default=None, metadata=OPTIONAL)
    held_against: str | None = field(default=None, metadata=OPTIONAL)
    why_not: str | None = field(default=None, metadata=OPTIONAL)
    known: float | None = field(default=None, metadata=OPTIONAL)
    effective: float | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True)
class Found:
    """The runs, the digits of the reference that are certain, and single steps.

    agreed: the digits in which two references of a scene in numbers agree. duration: the final
    time of the runs.
    """

    rows: Sequence[Row] = ()
    measured: Measured = field(default_factory=Measured)
    certain: float = 0.0
    agreed: float | None = field(default=None, metadata=OPTIONAL)
    local: SingleSteps | None = None
    duration: float = 0.0

    @property
    def trusted(self) -> float:
        """The digits of the reference that are certain, and above a program's own floor."""
        share = self.local.share if self.local else 0.0
        return min(self.certain, -math.log10(share)) if share else self.certain


@dataclass(frozen=True, slots=True)
class Expected:
    """The expected order and its tolerance; declared: the order in another chart."""

    order: float | None = None
    tolerance: float | None = None
    declared: float | None = None
    effective: float | None = None
