"""Runs of all kinds: one stepper's protocol, one loop, one trajectory, checkpoints."""

from .derivatives import RunDerivatives, RunGradient
from .stepper import File, Progress, Stepper, run
from .trajectory import Allocate, Trajectory, allocated

__all__ = [
    "Allocate", "File", "Progress", "RunDerivatives", "RunGradient", "Stepper", "Trajectory",
    "allocated", "run",
]  # fmt: skip
