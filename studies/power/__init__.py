"""Seeded faults that must be caught, and random valid rules that must not be."""

from ..core.study import Study

STUDY = Study(
    name="power",
    package=__name__,
    place=10,
    title="The power of the bench",
    summary="seeded faults that must be caught, and random valid rules that must not be",
    measured="seeded faults in rules, groupoids, equations and the solver; random valid rules",
    judged="every fault caught or proved to be none, no false alarm",
    about=(
        "The bench itself is tested: seeded faults in rules, groupoids, retractions, derived "
        "equations, coefficients of compositions and the solver (a sign, a factor, a missing or "
        "wrong power, an index, a transposed matrix, a stale value, the misprints of the paper) "
        "each go through the studies, and so do random rules that are valid. A fault has to be "
        "caught by one study at least, or proved to be none; no valid rule may be refused. It "
        "can mislead: runs are short and uncompiled, on four scenes, so a fault that only shows "
        "after a million steps survives here and is caught by the whole studies; and faults are "
        "as many as somebody thought of."
    ),
    usual=False,
)
