"""The records of defects of forms, of steps and of constraints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ..core.records import OPTIONAL, SPREAD, decoded
from ..core.single_steps import SingleSteps

Defects = Mapping[str, float | None]


@dataclass(frozen=True, slots=True)
class Row:
    """The defects of the step from a point of a run by kind; None where one is not measured."""

    step: float = 0.0
    index: int = 0
    time: float = 0.0
    defects: Defects = field(default_factory=dict, metadata=SPREAD)


@dataclass(frozen=True, slots=True)
class Found:
    """The rows, the largest defect of each kind (and the mean rate at which volume shrinks).

    local: single steps. left_out_step: a step that could not be followed.
    """

    rows: Sequence[Row] = ()
    measured: Defects = field(default_factory=dict)
    local: SingleSteps | None = None
    left_out_step: float | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True)
class Defect:
    """A defect relative to the terms from which it is made.

    certain: the part of it that the errors of the derivative cannot explain, or 0. measured: the
    largest value. resolution: the largest value that these errors may hide. entry: the worst entry.
    """

    certain: float = 0.0
    measured: float = 0.0
    resolution: float = 0.0
    entry: Sequence[int] = ()


@dataclass(frozen=True, slots=True)
class Held:
    """How far a derivative that a program gives is off, beyond the errors of differences.

    what: "jacobian", that of a step, or "gradient", that of a run; by the start, or by a parameter
    of that name. hidden: what these errors may hide. Both are in units of the motion. steps: those
    of the run.
    """

    what: str = ""
    by: str = ""
    off: float = 0.0
    hidden: float = 0.0
    steps: int = 1


@dataclass(frozen=True, slots=True)
class OfNumbers:
    """The defects of a step of a program from a place, or the reason why it makes none there.

    certain: the part of a defect that no error explains. left: the defect that a method of the
    order, but not symplectic, would leave there. again: the difference of a repeated step.
    jacobian: how far the program's own derivative is certainly off.
    """

    step: float = 0.0
    index: int = 0
    time: float = 0.0
    pullback: float | None = None
    poisson: float | None = None
    certain: float | None = None
    resolution: float | None = None
    left: float | None = None
    loop: float | None = None
    volume: Defect | None = None
    again: float | None = None
    jacobian: float | None = field(default=None, metadata=OPTIONAL)
    derivatives: Sequence[Held] = field(default=(), metadata=OPTIONAL)
    noise: float = 0.0
    residual: float | None = None
    why_not: str = ""
    entry: str = ""
    state: Sequence[float] = ()


@dataclass(frozen=True, slots=True)
class MeasuredOfNumbers:
    """The defect, its certain part, the resolution, the difference of a repeated step."""

    pullback: float | None = None
    poisson: float | None = None
    certain: float | None = None
    resolution: float | None = field(default=None, metadata=OPTIONAL)
    residual: float | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True)
class OfRun:
    """The form along a run of a program, of so many steps of that size.

    wanted: the steps over which the form is to be resolved. seen: those of one run after which it
    was, covered: those of such runs one after another. certain: the defect that no error explains,
    after `broken` steps; 0 without one. again: the difference from the same steps made again. left:
    the most steps after which an orbit of a map leaves its box; 0 if one stays.
    """

    step: float = 0.0
    steps: int = 0
    wanted: int = 0
    seen: int = 0
    covered: int = 0
    certain: float = 0.0
    broken: int = 0
    again: float = 0.0
    left: int = 0


@dataclass(frozen=True, slots=True)
class Jump:
    """A jump of a step at a state, over the motion.

    across: the share of it that is not along the image of the surface where it is; None if unknown.
    """

    size: float = 0.0
    across: float | None = None
    step: float = 0.0
    state: Sequence[float] = ()


@dataclass(frozen=True, slots=True)
class FoundOfNumbers:
    """The rows of a program, the worst of each, the form along a run, and its single steps.

    around: the number of drawn states at which plain differences looked for faults. jumps: those
    that lines through these states met.
    """

    rows: Sequence[OfNumbers] = ()
    measured: MeasuredOfNumbers = field(default_factory=MeasuredOfNumbers)
    run: OfRun = field(default_factory=OfRun)
    around: int = 0
    jumps: Sequence[Jump] = ()
    local: SingleSteps | None = None


def found_in(measurement: Mapping[str, Any]) -> Found | FoundOfNumbers:
    """Return the record of a measurement: that of a program has a run."""
    kind: Any = FoundOfNumbers if "run" in measurement else Found
    found: Found | FoundOfNumbers = decoded(kind, measurement)
    return found


@dataclass(frozen=True, slots=True)
class Expected:
    """The largest defect of a form, the least of a control, and the kinds that are demanded.

    Without `demanded` all kinds are.
    """

    limit: float | None = None
    at_least: float | None = None
    demanded: Sequence[str] = ()
