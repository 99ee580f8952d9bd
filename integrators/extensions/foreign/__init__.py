"""Integrators that are programs: functions of numbers, run and judged without changes."""

from ...rules import Claims
from .box import BlackBox, black_box
from .box_flow import BoxFlow
from .box_scheme import BoxScheme
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
from .program import ProgramFailure
from .recorded import Recorded, RecordedScheme, recorded
from .scene_in_numbers import SceneInNumbers, scene_in_numbers
from .states import State

__all__ = [
    "BlackBox", "BoxFlow", "BoxScheme", "Claims", "Derivative", "MapOfRows", "Noise",
    "ProgramFailure", "Recorded", "RecordedScheme", "SceneInNumbers", "State", "black_box",
    "derivative", "external", "guarded", "images", "jump_on", "noise_of", "recorded",
    "scene_in_numbers", "shifted",
]  # fmt: skip
