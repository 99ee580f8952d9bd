"""The records of linear intervals and of maps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ..core.records import OPTIONAL

FARTHEST = 1000.0  # the largest hω of the oscillator that is tried
FARTHEST_OWN = 6.0  # that of a user's own scene at its equilibrium


def percent(share: float) -> str:
    """Return a share in words: two figures of a small one, whole per cents of a large one."""
    percents = 100 * share
    return f"{percents:.2g} %" if percents < 10 else f"{percents:.0f} %"


@dataclass(frozen=True, slots=True)
class Row:
    """A step of the oscillator (z = hω, radius, phase, krein), or a cell of a map.

    outcome: the class of the run in a cell, steps and cause: how far it came, and why it ended
    before its time. between: the name of a cell between two of the grid.
    """

    z: float = 0.0
    radius: float | None = None
    phase: float | None = None
    krein: float | None = None
    stiffness: float = 0.0
    steps: int | None = None
    cause: str = ""
    outcome: str = field(default="", metadata={"key": "class"})
    between: str | bool | None = None


@dataclass(frozen=True, slots=True)
class Cell:
    """A run of a map: its z = hω, stiffness, steps and time, its class, and why it ended.

    band: that of the energy. adiabatic: the largest relative change of an adiabatic invariant.
    between: True for a cell between those of the grid.
    """

    stiffness: float = 0.0
    z: float = 0.0
    step: float = 0.0
    steps: int = 0
    time: float = 0.0
    band: float | None = None
    adiabatic: float | None = None
    cause: str = ""
    outcome: str = field(default="", metadata={"key": "class"})
    between: bool | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True)
class Measured:
    """The interval of a linear step, and the classes of a map's cells.

    off_circle: the hω at which an eigenvalue leaves the circle. stable_to: the end of the interval.
    limits: by stiffness the largest hω up to which all is bounded. exchange, stiffer, adiabatic:
    errors of the energies of stiff springs by hω or ω. runs: True if runs beside the interval's end
    agree. fastest: the largest rate along the scene's own motion. turns: True if the equilibrium is
    a body that turns steadily.
    """

    off_circle: float | None = None
    stable_to: float | None = None
    gaps: Sequence[Sequence[float]] = ()
    proved: bool = True
    classes: Mapping[str, int] | None = None
    equilibrium: Sequence[float] | None = None
    frequency: float | None = None
    limits: Mapping[str, float | None] | None = None
    between: Mapping[str, str] | None = None
    exchange: Mapping[str, float | None] | None = None
    stiffer: Mapping[str, float | None] | None = None
    adiabatic: Mapping[str, float | None] | None = None
    runs: bool = True
    fastest: float | None = None
    turns: bool = False


@dataclass(frozen=True, slots=True)
class Found:
    """A linear interval or a map: its rows and what they show.

    label: the name of the stiffness.
    """

    kind: str = ""
    label: str = ""
    rows: Sequence[Row] = ()
    measured: Measured = field(default_factory=Measured)


@dataclass(frozen=True, slots=True)
class Expected:
    """The hω up to which cells have to be bounded, and how many are not judged."""

    bounded_up_to: float | None = None
    of: int | None = None
    escapes_not_judged: int | None = None
    bounded: int | None = None
    off_circle: bool | None = None
