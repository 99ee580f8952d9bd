"""The records of rules whose steps vary."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Measured:
    """The order, the miss of a run and back, the defect of the form, the energy along a run."""

    order: float | None = None
    back: float | None = None
    form: float | None = None
    band: float | None = None
    slope: float | None = None


@dataclass(frozen=True, slots=True)
class Expected:
    """The expected order and limits, or a sentence why there is none."""

    order: int | None = None
    back: float | str | None = None
    form: float | str | None = None
    slope_limit: float | None = None
