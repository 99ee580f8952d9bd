"""The end of a motion itself, at a collision or a pole: no method can be blamed for it."""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING

from discmech.integrators import BadInput
from discmech.integrators.scene import remembered

from .case import Case
from .parts import parts_of

if TYPE_CHECKING:
    from discmech.integrators import Scene
    from discmech.reference import MotionEnds


def refuse_ended(case: Case, time: float) -> None:
    """Raise `MotionEnds` if the motion itself (to a collision, a pole) ends before twice that time.

    A method that stops in the first half of the way there stops by itself. A reference that cannot
    be computed, or takes too many steps beyond the scene's duration, decides nothing.
    """
    if "equations" not in parts_of(case.scene) or case.scene.lagrangian is None:
        return
    end = _end_of(case.scene, 2 * time)
    if end is not None and end.time < 2 * time:
        raise copy(end)  # a traceback would keep the run


@remembered(maxsize=64)  # rules of one scene, and faults of one rule, ask for the same
def _end_of(scene: Scene, time: float) -> MotionEnds | None:
    """Return the end of the motion on the way to a time, if a reference finds one."""
    from discmech import reference

    try:
        reference.solution(scene, scene.duration, digits=30, proof=False)
        if time > scene.duration:
            reference.follow(scene, time)
    except reference.MotionEnds as end:
        return copy(end)  # its traceback would keep the first caller
    except (reference.ReferenceFailure, BadInput):
        pass
    return None
