"""The records of steps forth and back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from ..core.records import OPTIONAL
from ..core.single_steps import SingleSteps


@dataclass(frozen=True, slots=True)
class Row:
    """The distance from the start after a step forth and back, at a time of the run."""

    step: float = 0.0
    index: int = 0
    time: float = 0.0
    defect: float | None = None


@dataclass(frozen=True, slots=True)
class OfReturn:
    """The distance after a step of a program forth and back, or the reason why there is none.

    certain: the part that no round-off explains, and entry the component that it is largest in.
    left: what a method of the order may leave. count: the number of steps forth, and then back.
    """

    step: float = 0.0
    index: int = 0
    time: float = 0.0
    defect: float | None = None
    certain: float | None = None
    why_not: str = ""
    resolution: float | None = field(default=None, metadata=OPTIONAL)
    left: float | None = field(default=None, metadata=OPTIONAL)
    count: int = 1
    entry: str = ""


@dataclass(frozen=True, slots=True)
class Measured:
    """The largest distance; of a program its certain part, and the resolution."""

    defect: float | None = None
    certain: float | None = field(default=None, metadata=OPTIONAL)
    resolution: float | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True)
class Found:
    """The rows, the largest distance along the run, and single steps."""

    rows: Sequence[Row] = ()
    measured: Measured = field(default_factory=Measured)
    local: SingleSteps | None = None


@dataclass(frozen=True, slots=True)
class FoundOfNumbers:
    """The rows of a program, the largest of each, and what a method of its order may leave.

    asked: the number of states along the motion from which steps of all sizes went back.
    """

    rows: Sequence[OfReturn] = ()
    left: float | None = field(default=None, metadata=OPTIONAL)
    measured: Measured = field(default_factory=Measured)
    asked: int = 0
