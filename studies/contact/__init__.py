"""The laws of steps under contact: cones, energy, momentum, times of impacts."""

from ..core.options import control_option
from ..core.study import StudyFolder
from .limits import LIMITS

#: steps with a fault, each of which breaks one of the laws
STICKS, WRONG_SIGN, MISSED = "contact that sticks", "friction of the wrong sign", "missed impact"
CONTROL = control_option("a contact", lambda: (STICKS, WRONG_SIGN, MISSED))

STUDY = StudyFolder(
    name="contact",
    package=__name__,
    claims=("order", "symplectic", "reversible", "energy", "energy band", "volume"),
    limits=LIMITS,
    place=3.6,
    example=("bouncing-ball", 40),
    asks_for="contact",
    title="Contact",
    summary="contact with friction: cones, energy, momentum, times of impacts",
    asks="are impacts and friction right?",
    measured=(
        "penetration, signs, complementarity, Coulomb's cone, energy and momentum over impacts, "
        "times of impacts, Ω between and across elastic ones; stepped and located"
    ),
    judged=(
        "round-off; impacts late by at most a step, and at times of the rule's order; a contact "
        "that sticks, friction of the wrong sign and a missed impact must be caught"
    ),
    about=(
        "A scene with contact is run twice, with impacts at the ends of steps and located inside "
        "them. Nothing may penetrate or pull, friction stays in its cone and against the slip, no "
        "impact adds energy, and the momentum changes by the impulses that are reported. It can "
        "mislead: all of this holds of a motion that is late by a step, or, after many impacts of "
        "a chaotic scene, elsewhere altogether; only the time of the first impacts is compared."
    ),
    options=(CONTROL,),
)
