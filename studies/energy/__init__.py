"""Energy band and secular slope over 10⁶ steps."""

from ..core.study import StudyFolder
from .limits import LIMITS

STUDY = StudyFolder(
    name="energy",
    package=__name__,
    claims=("energy", "energy band"),
    limits=LIMITS,
    place=3,
    example=("kepler", 2000),
    asks_for="energy",
    turn=0,
    title="Energy",
    summary="energy band and secular slope over 10⁶ steps",
    asks="does the energy stay in a band?",
    measured=(
        "band and secular slope over 10⁶ steps; under a force or explicit time the balance with "
        "their work"
    ),
    judged=(
        "the modified energy stands, else the slope explains at most a tenth of the band; "
        "energy less work falls with the step; "
        "nonholonomic: measured only"
    ),
    about=(
        "No variational integrator with a fixed step keeps the energy, but its error stays in a "
        "band and does not drift. The band is the size of that oscillation, the slope is its "
        "trend over the whole run with an interval. It can mislead: a bounded energy error says "
        "nothing about the error in phase, and near a resonance or at too large a step the band "
        "can be wide without a sign of drift."
    ),
)
