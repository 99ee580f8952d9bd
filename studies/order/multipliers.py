"""The multipliers of constraints: their errors on the ladder, and the verdict that these deny."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from discmech.integrators import StepFailure, mean_multipliers
from discmech.integrators.flows import Flow, Trajectory

from ..core.case import Case
from ..systems.runs import gap
from .records import Row
from .window import floor, slope_of_multipliers


def error(flow: Flow, run: Trajectory, forces: Any) -> float:
    """Return the relative error of mean multipliers at a run's end; NaN if its step back fails."""
    try:
        off, size = gap(mean_multipliers(flow, run)[-1], forces)
    except StepFailure:  # this does not concern (x, μ)
        return math.nan
    return float(off / size)


def decided(case: Case, rows: Sequence[Row], certain: float) -> bool:
    """True if multipliers have a slope, or are exact."""
    exact = max(known(rows), default=0.0) <= floor(case, certain)
    return exact or slope_of_multipliers(case, rows, certain) is not None


def known(rows: Sequence[Row]) -> list[float]:
    """Return the errors of those runs whose step back was made."""
    errors = (row.multipliers for row in rows)
    return [error for error in errors if error is not None and not math.isnan(error)]
