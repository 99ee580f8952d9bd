"""The multipliers of constraints: their errors on the ladder, and the verdict that these deny."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from discmech.integrators import StepFailure, mean_multipliers
from discmech.integrators.flows import Flow, Trajectory

from ..core.case import Case
from ..core.outcome import Row
from ..core.runs import gap
from .window import floor, slope


def error(flow: Flow, run: Trajectory, forces: Any) -> float | None:
    """Return the relative error of mean multipliers at a run's end; None if its step back fails."""
    try:
        off, size = gap(mean_multipliers(flow, run)[-1], forces)
    except StepFailure:  # this does not concern (x, μ)
        return None
    return float(off / size)


def decided(case: Case, rows: Sequence[Row], certain: float) -> bool:
    """True if multipliers have a slope, or are exact."""
    errors = [e for r in rows if (e := r.get("multipliers")) is not None]
    exact = max(errors, default=0.0) <= floor(case, certain)
    return exact or slope(case, rows, "multipliers", certain) is not None
