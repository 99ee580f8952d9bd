"""Order of accuracy against certified references."""

from ..core.study import StudyFolder
from .limits import LIMITS

STUDY = StudyFolder(
    name="order",
    package=__name__,
    claims=("order", "effective"),
    place=0,
    limits=LIMITS,
    asks_for="end",
    turn=2,
    title="Order of accuracy",
    summary="order of accuracy against certified references",
    asks="does the error shrink at the stated order?",
    measured=(
        "error in (x, μ) against a certified reference on a ladder of steps, in double "
        "precision and at 50 digits"
    ),
    judged=(
        "slope over the asymptotic window, from both sides: ±{double precision}, at 50 digits "
        "±{more digits}; or a sum of this power of the step and the next two, in which a lower "
        "one has no such share"
    ),
    about=(
        "Each scheme runs to the same time on a ladder of step sizes, and its error in (x, μ) "
        "is taken against a reference that shares no formula with it. The slope of log error "
        "over log step is fitted where the error is asymptotic, and has to agree, from above as "
        "from below, with the order that the rule has on that scene. It can mislead: an "
        "accident of the scene can lift the order (rectangle is of order 2 where the Lagrangian "
        "does not depend on x), and with 16 digits few points may remain between the bend at "
        "large steps and the floor of round-off; the run with 50 digits has no such floor."
    ),
)
