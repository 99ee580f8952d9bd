"""Linear intervals, and maps of stiff scenes over step and stiffness."""

from ..core.options import THOROUGH, control_option
from ..core.study import StudyFolder
from .limits import LIMITS

EULER, RUNGE_KUTTA = "explicit Euler", "classical Runge-Kutta"
CONTROL = control_option("a method", lambda: (EULER, RUNGE_KUTTA))

STUDY = StudyFolder(
    name="stability",
    package=__name__,
    limits=LIMITS,
    place=5,
    example=("harmonic", 50),
    title="Stability",
    summary="linear intervals, and maps of stiff scenes over step and stiffness",
    asks="up to which step is it bounded?",
    measured=(
        "linear intervals by the exact step's trace; maps of stiff scenes over step and "
        "stiffness; the chain's energy exchange"
    ),
    judged=(
        "what runs beside an interval's ends agrees with it; the exchange is right; two damped "
        "controls must be caught"
    ),
    about=(
        "Linear: the exact step of a rule on the harmonic oscillator is a matrix that depends "
        "on hω alone; it is stable where its eigenvalues lie on the unit circle, apart from "
        "each other. The ends of the intervals are found by bisection, and runs of 10⁵ steps on "
        "both sides of the first end have to say the same. Nonlinear: every scene with a stiff "
        "motion runs over a grid of step sizes and stiffnesses, and each run falls into one of "
        "five classes. A rule has to be bounded wherever the step resolves the motion "
        "(hω ≤ {resolved}); beyond that the map shows where each rule ends. It can "
        "mislead: a bounded run is not an accurate one (the picture of fpu shows how far the "
        "exchange of energy goes wrong while every run is stable), a map sees no more than its "
        "runs are long, and a narrow resonance may lie between two cells."
    ),
    options=(CONTROL, THOROUGH),
)
