"""The records of rules whose steps vary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ..core.records import OPTIONAL
from ..core.single_steps import SingleSteps


@dataclass(frozen=True, slots=True)
class Measured:
    """The order, the miss of a run and back, the defect of the form, the energy along a run.

    lost: why no run from one of the places goes through, whose way back and form are then unknown.
    """

    order: float | None = None
    back: float | None = None
    form: float | None = None
    band: float | None = None
    slope: float | None = None
    lost: str | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True)
class Row:
    """A run of the ladder with its ε, its end and its error there."""

    step: float = 0.0
    steps: int = 0
    time: float = 0.0
    error: float = 0.0


@dataclass(frozen=True, slots=True)
class Found:
    """The numbers that were measured, and the orders from row to row.

    energy: the entries of the study of energy, or why no run goes through (`failed`). local: the
    order of single steps. self_adjoint: True if the rule is so in its own time.
    """

    measured: Measured = field(default_factory=Measured)
    orders: Sequence[float] = ()
    energy: Mapping[str, Any] = field(default_factory=dict)
    local: SingleSteps | None = None
    self_adjoint: bool = False


@dataclass(frozen=True, slots=True)
class Expected:
    """The expected order and limits, or a sentence why there is none."""

    order: int | None = None
    back: float | str | None = None
    form: float | str | None = None
    slope_limit: float | None = None
