"""The records of lattices: of fields, of contact at sites, of cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..core.single_steps import SingleSteps


@dataclass(frozen=True, slots=True)
class Row:
    """A row of a kind: of the order in space (step, error), or of cost (sites, nanoseconds).

    c: the nanoseconds of plain loops in C.
    """

    kind: str = ""
    step: float | None = None
    error: float | None = None
    used: bool = False
    why_not: str | None = None
    sites: float | None = None
    nanoseconds: float | None = None
    c: float | None = None
    bytes: float | None = None


@dataclass(frozen=True, slots=True)
class Grows:
    """The power of the number of sites with which the time of a step grows."""

    time: float | None = None


@dataclass(frozen=True, slots=True)
class Measured:
    """The order in space and the defects of laws; with contact at sites, those of its laws."""

    space_order: float | None = None
    poisson: float | None = None
    patch: float | None = None
    residual: float | None = None
    constraint: float | None = None
    hidden: float | None = None
    bond: float | None = None
    drift: float | None = None
    contact: Mapping[str, float] | None = None
    rises: Sequence[float] = ()
    impacts: int | None = None
    pushed: bool = False
    grows: Grows | None = None
    local: SingleSteps | None = None


@dataclass(frozen=True, slots=True)
class Expected:
    """The limits, and the expected order in space."""

    laws: float | None = None
    at_least: float | None = None
    limit: float | None = None
    residual: float | None = None
    space_order: int | None = None
