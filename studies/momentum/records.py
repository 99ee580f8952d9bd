"""The records of drifts of momenta, by the name of the quantity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Row:
    """The largest drift of each quantity in a stretch of the run, at its last step."""

    step: int = 0
    time: float = 0.0
    drift: Mapping[str, float | None] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Measured:
    """The largest drift of each quantity along the run, relative to the sum of its terms."""

    drift: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Expected:
    """The largest limit, the bare walk of round-off, and the steps over which each was followed."""

    limit: float | None = None
    random_walk: float | None = None
    over: Mapping[str, int] = field(default_factory=dict)
