"""The records of drifts of momenta, by the name of the quantity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ..core.records import OPTIONAL
from ..core.single_steps import SingleSteps


@dataclass(frozen=True, slots=True)
class Row:
    """The largest drift of each quantity in a stretch of the run, at its last step."""

    step: int = 0
    time: float = 0.0
    drift: Mapping[str, float | None] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Measured:
    """By quantity the largest drift along the run, relative to the sum of its terms.

    fault: the change by a seeded fault of one step. rate: the share of the terms of dJ/dt.
    """

    drift: Mapping[str, float] = field(default_factory=dict)
    fault: Mapping[str, float] | None = field(default=None, metadata=OPTIONAL)
    rate: Mapping[str, float] | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True)
class Fault:
    """The relative size of a seeded fault of one step, and the change by it."""

    size: float = 0.0
    change: float = 0.0


@dataclass(frozen=True, slots=True)
class Found:
    """The drifts of a run of so many steps.

    By quantity: units, the effect of round-off of a step and of the value, in ε; over, the steps
    over which it was followed; walks, the roundings that it had. lost: the drift that lost digits
    explain. Under contact, impacts: the number of those that were met; resting: that of the steps
    with other impulses; free: that of the steps without any. compared: the rows of a run of many
    sites from which steps were compared with their work.
    """

    rows: Sequence[Row] = ()
    measured: Measured = field(default_factory=Measured)
    steps: int = 0
    units: Mapping[str, Sequence[float]] = field(default_factory=dict)
    faults: Mapping[str, Fault] | None = field(default=None, metadata=OPTIONAL)
    over: Mapping[str, int] | None = None
    walks: Mapping[str, int] | None = None
    lost: float | None = field(default=None, metadata=OPTIONAL)
    local: SingleSteps | None = None
    impacts: int | None = field(default=None, metadata=OPTIONAL)
    compared: int | None = field(default=None, metadata=OPTIONAL)
    resting: int = field(default=0, metadata=OPTIONAL)
    free: int | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True)
class Expected:
    """The largest limit, the bare walk of round-off, and the steps over which each was followed."""

    limit: float | None = None
    random_walk: float | None = None
    over: Mapping[str, int] = field(default_factory=dict)
