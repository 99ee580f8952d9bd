"""Systems that studies judge: a scheme of a scene, another program's integrator, or a lattice.

A study asks a system for the values that it measures (a flow, the energy of a run, the end of the
motion) and never for its kind. A missing value is None, and `lacks` gives the reason in a sentence.
"""

from __future__ import annotations

from functools import singledispatch
from typing import Any

from discmech.integrators import Lattice

from ..core.case import Case
from .lattice_system import LatticeSystem
from .scene_system import SceneSystem
from .system import End, Ladder, SiteMomentum, System

__all__ = ["End", "Ladder", "SiteMomentum", "System", "system_of"]


def system_of(case: Case) -> System:
    """Return the system of a case; nothing is derived before it is needed."""
    return _system(case.scene, case)


@singledispatch
def _system(thing: Any, case: Case) -> System:
    return SceneSystem(case)


@_system.register
def _(thing: Lattice, case: Case) -> System:
    return LatticeSystem(case)
