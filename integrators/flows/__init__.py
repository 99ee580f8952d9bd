"""Schemes and their flows: starts, steps, runs, failures."""

from ..compiler import cores
from .contact_flow import ContactFlow, ContactTrajectory
from .ensemble import Ensemble, side_by_side
from .flow import Flow, Trajectory
from .initial_state import Start
from .multipliers import mean_multipliers
from .newton_step import (
    arrow_from,
    form_change_defects,
    restricted_form_defect,
    return_defect,
    round_off_from,
    step_along,
)
from .run import first_u, run_from
from .scheme import Scheme
from .step_choice import StepChoice

__all__ = [
    "ContactFlow", "ContactTrajectory", "Ensemble", "Flow", "Scheme", "Start", "StepChoice",
    "Trajectory", "arrow_from", "cores", "first_u", "form_change_defects", "mean_multipliers",
    "restricted_form_defect", "return_defect", "round_off_from", "run_from",
    "side_by_side", "step_along",
]  # fmt: skip
