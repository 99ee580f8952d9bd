"""Integrators that are programs: functions of numbers, run where they are, judged as they are."""

from ..rules import Claims
from .box import BlackBox, black_box
from .box_flow import BoxFlow
from .box_scheme import BoxScheme
from .constrained import constrained_parameters, constraint_defects
from .differences import Derivative, Noise, derivative, guarded, noise_of
from .external import external
from .form_in_numbers import (
    Defect,
    form_defect,
    loop_defect,
    pulled_back_defect,
    random_curve,
    volume_defect,
)
from .program import ProgramFailure
from .recorded import Recorded, RecordedScheme, recorded
from .scene_in_numbers import SceneInNumbers

__all__ = [
    "BlackBox", "BoxFlow", "BoxScheme", "Claims", "Defect", "Derivative", "Noise",
    "ProgramFailure", "Recorded", "RecordedScheme", "SceneInNumbers", "black_box",
    "constrained_parameters", "constraint_defects", "derivative", "external", "form_defect",
    "guarded", "loop_defect", "noise_of", "pulled_back_defect", "random_curve", "recorded",
    "volume_defect",
]  # fmt: skip
