"""A step back after a step forth, for methods that claim to be self-adjoint."""

from ..core.study import StudyFolder

STUDY = StudyFolder(
    name="reversibility",
    package=__name__,
    claims=("reversible",),
    place=11,
    title="Reversibility",
    summary="a step back after a step forth, for methods that say they are self-adjoint",
    asks="does a step back return to the start?",
    measured="Φ₋ₕ after Φₕ at many points of a run; where a method claims it",
    judged="as symplecticity: round-off",
    about=(
        "A self-adjoint method undoes its step by a step of −h. How far Φ₋ₕ misses the point "
        "that Φₕ has left is measured along a run, each component relative to the terms it is "
        "made of. It can mislead: a method that is not self-adjoint is not wrong, so this is only "
        "asked of rules that say they are."
    ),
    usual=False,
)
