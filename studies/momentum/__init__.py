"""Momentum maps and Casimirs over 10⁶ steps."""

from ..core.study import StudyFolder
from .limits import LIMITS

STUDY = StudyFolder(
    name="momentum",
    package=__name__,
    limits=LIMITS,
    place=2,
    example=("lagrange-top", 500),
    asks_for="momenta",
    turn=0,
    title="Momentum maps",
    summary="momentum maps and Casimirs over 10⁶ steps",
    asks="are momentum maps and Casimirs kept?",
    measured=(
        "every declared momentum map and Casimir over 10⁶ steps; what a force changes against its "
        "discrete work"
    ),
    judged="≤ c·ε·√N of each quantity, relative to the sum of absolute terms",
    about=(
        "Every symmetry that a scene declares has a momentum map, and a Casimir where there is "
        "one, that the scheme keeps exactly but for round-off. The drift, relative to the sum "
        "of the absolute terms, must stay below the limit, and is compared with the random walk "
        "that rounding alone makes. It can mislead: a map that is zero by the choice of the "
        "start says little, and a solver stopped too early shows as a drift that grows linearly "
        "although the scheme is sound."
    ),
)
