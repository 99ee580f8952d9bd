"""What leaving out work that a scene does not need is worth."""

from discmech.studies.core.options import THOROUGH
from discmech.studies.core.study import StudyFolder

from .limits import LIMITS

STUDY = StudyFolder(
    name="savings",
    package=__name__,
    of_the_bench=True,
    limits=LIMITS,
    place=8,
    example=("pendulum", 50),
    title="What is left out",
    summary="what leaving out work that a scene does not need is worth",
    asks="what does skipped work save?",
    measured="operations, bytes and time of a step with and without each saving",
    judged="not judged on time",
    about=(
        "A kernel leaves out what its scene does not need: the Newton iteration where a step's "
        "equations are affine in u, what depends on the step and the parameters alone (computed "
        "once a flow), functions of x that the last step has computed, and on a group the base. "
        "Each saving is taken back by itself, and all variants run in one race; operations are "
        "counted in the generated text. In each column the kernel as it is comes first. A "
        "variant must give the same results up to round-off. It can mislead: a processor hides "
        "some of the work that is saved, so fewer operations are not as much less time."
    ),
    alone=True,
    options=(THOROUGH,),
)
