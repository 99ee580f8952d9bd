"""Integrators that are programs: functions of numbers, run and judged without changes."""

from ...rules import Claims
from .box import BlackBox, black_box
from .box_flow import BoxFlow
from .box_scheme import BoxScheme
from .constrained import constrained_parameters
from .differences import (
    Derivative,
    MapOfRows,
    Noise,
    derivative,
    guarded,
    images,
    jump_on,
    noise_of,
    shifted,
)
from .external import external
from .form_in_numbers import (
    Defect,
    form_defect,
    loop_defect,
    pulled_back_defect,
    random_curve,
    volume_defect,
)
from .leaves import leaf_defect
from .program import ProgramFailure
from .recorded import Recorded, RecordedScheme, recorded
from .scene_in_numbers import SceneInNumbers

__all__ = [
    "BlackBox", "BoxFlow", "BoxScheme", "Claims", "Defect", "Derivative", "MapOfRows", "Noise",
    "ProgramFailure", "Recorded", "RecordedScheme", "SceneInNumbers", "black_box",
    "constrained_parameters", "derivative", "external", "form_defect",
    "guarded", "images", "jump_on", "leaf_defect", "loop_defect", "noise_of", "pulled_back_defect",
    "random_curve", "recorded", "shifted", "volume_defect",
]  # fmt: skip
