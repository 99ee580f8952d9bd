"""Discrete optimal control: the two-point boundary problem of a scene, a cost and inputs."""

from .boundary_problem import Optimum
from .problem import Control
from .stages import ControlStages

__all__ = ["Control", "ControlStages", "Optimum"]
