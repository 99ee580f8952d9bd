"""Schemes and their flows: starts, steps, runs, failures."""

from ..compiler import cores
from ..runs import Trajectory, side_by_side
from .failures import CAUSES
from .flow import Flow
from .free_motion import FreeMotion, first_u
from .initial_state import Start
from .newton_step import (
    arrow_from,
    form_change_defects,
    growth_errors,
    restricted_form_defect,
    return_defect,
    round_off_from,
    step_along,
    volume_defect,
)
from .scene_runs import SceneRuns, Substeps
from .scheme import Scheme, mean_multipliers
from .step_choice import StepChoice

__all__ = [
    "CAUSES", "Flow", "FreeMotion", "SceneRuns", "Scheme", "Start", "StepChoice", "Substeps",
    "Trajectory", "arrow_from", "cores", "first_u", "form_change_defects", "growth_errors",
    "mean_multipliers", "restricted_form_defect", "return_defect", "round_off_from",
    "side_by_side", "step_along", "volume_defect",
]  # fmt: skip
