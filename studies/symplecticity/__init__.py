"""Pullback of Ω and Poisson form, with controls."""

from collections.abc import Iterable

from ..core.options import control_option
from ..core.study import StudyFolder
from .limits import LIMITS


def _methods() -> Iterable[str]:
    from ..core.controls import NAMES

    return NAMES


STUDY = StudyFolder(
    name="symplecticity",
    package=__name__,
    claims=("symplectic", "volume"),
    limits=LIMITS,
    place=1,
    example=("rigid-body", 24),
    asks_for="form",
    title="Symplecticity",
    summary="pullback of Ω and Poisson form, with controls",
    asks="is the symplectic form kept?",
    measured=(
        "pullback of Ω under the prolongation of Ψ, and the Poisson form on the dual, at many "
        "points, also at the largest stable step; under a force the change of Ω and of phase "
        "volume, under constraints the form on what they leave"
    ),
    judged=(
        "≤ {form}, with more digits {digits of a form} of them are left to round-off, in any "
        "units; under a force Ω changes by the differential of its work, under a nonholonomic "
        "constraint no form is demanded; steps and constraints within their round-off; "
        "Runge–Kutta, a damped residual and a flipped bracket must be caught"
    ),
    about=(
        "At many points of a trajectory the exact derivative of one step is tested twice: the "
        "pullback of the symplectic form on the groupoid, and the Poisson bracket on the dual. "
        "Each entry is relative to the terms it is made of, and must be at the level of "
        "round-off. It can mislead: at small steps every consistent method is nearly symplectic, "
        "so the schemes are "
        "tested at large steps, and methods known to be wrong, the controls, have to be caught "
        "by the same test."
    ),
    options=(control_option("a method", _methods),),
)
