"""Steps of every size on a group, beside the method bound to one chart."""

from discmech.studies.core.options import THOROUGH
from discmech.studies.core.study import StudyFolder

from .limits import LIMITS

STUDY = StudyFolder(
    name="charts",
    package=__name__,
    of_the_bench=True,
    limits=LIMITS,
    place=6,
    example=("moser-veselov", 6),
    title="Steps of every size",
    summary="steps of every size on a group, beside the method bound to one chart",
    asks="do steps of every size agree?",
    measured=(
        "steps from 0.01 to 0.99 of a turn on a group: margin, translates, residual, defects, "
        "momentum"
    ),
    judged="as symplecticity and momentum, at every change of chart",
    about=(
        "A scene whose discrete Lagrangian is given on the group itself is started with first "
        "steps of a hundredth of a turn to nearly a whole one, about six axes; where the margin "
        "of a chart grows small the step is written in that of another translate. Residual, "
        "defects and momentum are tested at every change of chart, and each step against a "
        "factorisation that needs no chart. It can mislead: beside it runs the same method "
        "bound to one chart, which keeps its momentum and solves its equations to round-off, "
        "and makes steps of another angle than it was asked for."
    ),
    options=(THOROUGH,),
)
