"""Processor time of proven digits, against digits and time."""

from discmech.studies.core.options import THOROUGH
from discmech.studies.core.study import StudyFolder

STUDY = StudyFolder(
    name="references",
    package=__name__,
    of_the_bench=True,
    place=9,
    title="What references cost",
    summary="processor time of proven digits, against digits and time",
    asks="what do proven digits cost?",
    measured="processor time of proven digits, against digits and against time",
    judged="all digits asked for are proven",
    about=(
        "Errors are taken against Taylor series in as many digits as are asked for, with a "
        "proven bound. Measured is the processor time of one such integration, pilot run and "
        "enclosure included, without deriving the equations; a case passes if all its digits "
        "are proven. A step of order N, which grows like 1.15 digits, costs N²/2 products of "
        "such numbers for each product in the equations. It can mislead: it is one scene, and a "
        "scene whose orbits come near a singularity, or separate, takes more."
    ),
    alone=True,
    usual=False,
    of_systems=False,
    options=(THOROUGH,),
)
