"""Integrators that are programs: functions of numbers, run and judged without changes."""

from .box import BlackBox, black_box
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
from .recorded import Recorded, recorded
from .scene_in_numbers import SceneInNumbers, scene_in_numbers
from .states import State

__all__ = [
    "BlackBox", "Derivative", "MapOfRows", "Noise",
    "Recorded", "SceneInNumbers", "State", "black_box",
    "derivative", "external", "guarded", "images", "jump_on", "noise_of", "recorded",
    "scene_in_numbers", "shifted",
]  # fmt: skip
