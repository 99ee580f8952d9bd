"""A study: what it is, in words. Names, help, tables, JSON and the report follow from these."""

from discmech.studies.core.study import Study

STUDY = Study(
    name="starter",
    package=__name__,
    place=50,  # in the report
    title="Corrections of a step",
    summary="how many of Newton's corrections a step takes",
    asks="how much work is a step?",
    measured="Newton's corrections, mean and most, over the steps of a run",
    judged="at most ten in the mean",
    about=(
        "Each step is solved by Newton's iteration from an extrapolated start; counted is how many "
        "corrections it takes. It can mislead: at smaller steps fewer are needed."
    ),
)
