"""The records of defects of forms, of steps and of constraints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Row:
    """The defects of the step from a point of a run; None where one is not measured."""

    step: float = 0.0
    index: int = 0
    time: float = 0.0
    pullback: float | None = None
    poisson: float | None = None


@dataclass(frozen=True, slots=True)
class Measured:
    """The largest defect of each kind, and the mean rate at which volume shrinks."""

    pullback: float | None = None
    poisson: float | None = None
    change: float | None = None
    volume: float | None = None
    residual: float | None = None
    constraint: float | None = None
    hidden: float | None = None
    contraction: float | None = None


@dataclass(frozen=True, slots=True)
class Expected:
    """The largest defect of a form, the least of a control, and the kinds that are demanded.

    Without `demanded` all kinds are.
    """

    limit: float | None = None
    at_least: float | None = None
    demanded: Sequence[str] = ()
