"""Runs of all kinds: one stepper's protocol, one loop, one trajectory, ensembles, checkpoints."""

from .ensemble import Ensemble, side_by_side
from .stepper import OF_ONE_MAP, File, FlowRuns, NotOneMap, Progress, Stepper, run
from .trajectory import Allocate, RunDerivatives, RunGradient, Trajectory, allocated

__all__ = [
    "OF_ONE_MAP", "Allocate", "Ensemble", "File", "FlowRuns", "NotOneMap", "Progress",
    "RunDerivatives", "RunGradient", "Stepper", "Trajectory", "allocated", "run", "side_by_side",
]  # fmt: skip
