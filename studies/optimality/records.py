"""The records of problems of control whose steps are halved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ..core.single_steps import SingleSteps


@dataclass(frozen=True, slots=True)
class Row:
    """The change of a solution when its steps are halved, and why it is not in the fit."""

    step: float | None = None
    error: float | None = None
    controls: float = 0.0
    used: bool = False
    why_not: str | None = None


@dataclass(frozen=True, slots=True)
class Measured:
    """The lowest order, that of each kind of unknown, the kinds that change by round-off alone.

    corrections: of each solution; cost: of the finest, a local minimum.
    """

    order: float | None = None
    interval: Sequence[float] | None = None
    orders: Mapping[str, float | None] = field(default_factory=dict)
    exact: Sequence[str] = ()
    corrections: Sequence[int] = ()
    cost: float | None = None


@dataclass(frozen=True, slots=True)
class Found:
    """The rows, the orders, the largest change that is round-off, and the order of single steps."""

    rows: Sequence[Row] = ()
    measured: Measured = field(default_factory=Measured)
    floor: float = 0.0
    local: SingleSteps | None = None


@dataclass(frozen=True, slots=True)
class Expected:
    """The order of the rule, and its tolerance."""

    order: float | None = None
    tolerance: float | None = None
