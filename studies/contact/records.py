"""The records of laws of contact."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Laws:
    """The largest defect of each law along a run, its impacts, and the rises of the energy."""

    penetration: float | None = None
    pull: float | None = None
    complementarity: float | None = None
    cone: float | None = None
    slip: float | None = None
    impact_energy: float | None = None
    jump: float | None = None
    impacts: int | None = None


@dataclass(frozen=True, slots=True)
class Measured:
    """The laws of a stepped and of a located run, and the order of located impacts."""

    stepped: Laws | None = None
    located: Laws | None = None
    order: float | None = None


@dataclass(frozen=True, slots=True)
class Expected:
    """The largest defect of a law."""

    limit: float | None = None
