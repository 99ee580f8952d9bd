"""The limits of contact; its laws have those of the forms of steps."""

from ..core.limits import Limit

LIMITS = {
    "turn": Limit(
        0.125, "1 − cos of the angle by which a slip may leave those at both ends of a step",
        "set: a slip may turn by 29° between events; of planes of one direction none turns. It "
        "errs towards a pass",
    ),
    "slack": Limit(
        0.4, "what the order of located impacts may lack of the rule's",
        "derived: of two steps the finer is not fine yet; the error of an eighth of it, with which "
        "both are compared, is (1/8)^p of the first",
    ),
    "excess": Limit(
        8, "what the order of located impacts may have beyond the rule's",
        "set: an error that falls by 2⁸ more is of one step that went wrong; it errs towards "
        "inconclusive",
    ),
    "falls": Limit(
        1.5, "factor by which what vanishes with the step falls",
        "set: order 1 gives 2, but the place of an impact in its step counts too; it errs towards "
        "a pass",
    ),
    "form": Limit(
        1e-20, "defect of Ω across an impact that is none",
        "derived: differences of a width of 10⁻¹² of the state are off by its square, 10⁻²⁴",
    ),
}  # fmt: skip
