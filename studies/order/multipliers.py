"""The multipliers of constraints: their errors on the ladder, and the verdict that these deny."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from discmech.integrators import StepFailure, mean_multipliers
from discmech.integrators.flows import Flow, Trajectory
from discmech.integrators.numbers import mpmath

from ..core.case import Case
from ..systems.runs import gap
from .records import Row
from .window import floor, slope_of_multipliers


def error(flow: Flow, run: Trajectory, forces: Any, sizes: Any) -> float:
    """Return the error of mean multipliers at a run's end; NaN if its step back fails.

    sizes: those of all that acts on the constraints (`multiplier_sizes`), to which it is relative:
    where this cancels, a multiplier is as small as round-off and no measure of anything.
    """
    try:
        off, _ = gap(mean_multipliers(flow, run)[-1], forces)
    except StepFailure:  # this does not concern (x, μ)
        return math.nan
    return float(off / mpmath.norm(sizes, 2))


def decided(case: Case, rows: Sequence[Row], certain: float) -> bool:
    """True if multipliers have a slope, or are exact."""
    exact = max(known(rows), default=0.0) <= floor(case, certain)
    return exact or slope_of_multipliers(case, rows, certain) is not None


def known(rows: Sequence[Row]) -> list[float]:
    """Return the errors of those runs whose step back was made."""
    errors = (row.multipliers for row in rows)
    return [error for error in errors if error is not None and not math.isnan(error)]
