"""Runs at the edge of each scene, and how their failures are noticed."""

from ..core.options import Option, refuse
from ..core.study import StudyFolder


def _extreme(name: str) -> str:
    from .edges import EXTREMES

    known = dict.fromkeys(e.name for several in EXTREMES.values() for e in several)
    if name not in known:
        shown = ", ".join(f'"{word}"' for word in known)
        refuse(f'there is no extreme "{name}": there are {shown}.')
    return name


STUDY = StudyFolder(
    name="extremes",
    package=__name__,
    place=7,
    example=("charged-particle", 50),
    title="Extremes",
    summary="what happens at the edge of each scene, and how it is noticed",
    asks="is every failure noticed?",
    measured="every scene at its edge, by every rule: what happened and how it was noticed",
    judged="nothing that is wrong may go without a sign",
    about=(
        "Every scene is taken to its edge (eccentricities near one, starts beside a separatrix, "
        "scales of 10¹⁰⁰ and 10⁻¹⁰⁰, ratios of inertia of 10⁸, springs and fields that are very "
        "stiff), once with a step that resolves the fastest motion, once with one that does not. "
        "A run may be right, it may stop with a message, or it may return with a wrong result; "
        "then a third or a sixteenth of the step, or the energy, has to tell. A run that is "
        "wrong by more than a hundredth while nothing tells is silent, and fails. It can "
        "mislead: the reference is asked for the end of the run only, and where there is none "
        "(a fall into the centre) only the signs are shown."
    ),
    options=(
        Option("--extreme", 'only this one, such as "e = 0.99"', "NAME", _extreme, repeated=True),
    ),
)
