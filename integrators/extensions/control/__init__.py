"""Discrete optimal control: the two-point boundary problem of a scene, a cost and inputs."""

from .boundary_problem import Optimum
from .problem import Control

__all__ = ["Control", "Optimum"]
