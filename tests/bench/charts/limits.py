"""The limits of steps of every size; a walk of momenta has those of momentum and symplecticity."""

from discmech.studies.core.limits import Limit

SOLVED = ("residual", "factorisation", "distance", "operator")
FORMS = ("pullback", "poisson")

LIMITS = {
    "solved": Limit(
        1e-13, f"{', '.join(SOLVED)} of a step in double precision",
        "set: some hundreds of round-offs; distances are taken times the regularity, since beside "
        "the singular set of FL what is solved for is off by its inverse. It errs towards a pass",
    ),
    "forms": Limit(
        1e-12, "defect of a form of a step in double precision",
        "set: some thousands of round-offs; it errs towards a pass",
    ),
    "singular": Limit(
        1e-3, "regularity of FL below which a run may stop",
        "set: FL is singular near a quarter turn, where no step continues; it errs towards a fail",
    ),
    "stopped": Limit(
        0.1, "share of the runs that may stop",
        "set: with more of them too little is seen; it errs towards inconclusive",
    ),
}  # fmt: skip
