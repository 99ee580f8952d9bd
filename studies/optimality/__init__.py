"""Optimal control: the order of states, costates and controls under refinement."""

from ..core.study import StudyFolder
from .limits import LIMITS

STUDY = StudyFolder(
    name="optimality",
    package=__name__,
    limits=LIMITS,
    place=9,
    example=("oscillator", 16),
    title="Optimal control",
    summary="order of states, costates and controls of a problem of optimal control",
    asks="is a controlled motion optimal?",
    measured=(
        "how much states, costates and controls at the nodes change when the steps are halved; "
        "Newton's corrections"
    ),
    judged="the order of each, to the limit of orders, or no change but round-off",
    about=(
        "A problem of optimal control is solved with steps that are halved from solution to "
        "solution: what changes is the error of the coarser one, to the order of the rule. Each of "
        "states, costates and controls at the nodes has to have that order, and each solution is "
        "checked to be a local minimum; the next one begins there, so that all are of one branch. "
        "It can mislead: another motion may cost less; what they converge to is held against "
        "closed forms in the tests, not here."
    ),
)
