"""The limits of races."""

from ..core.limits import Limit

LIMITS = {
    "stalled": Limit(
        2.0**-26, "error at which a method may stop",
        "set: √ε; one that ends above it, and above its floor, solves another problem. It errs "
        "towards a pass",
    ),
    "floors": Limit(
        1000, "error at which a method may stop, over the floor that the rounded start leaves",
        "set: it errs towards a pass",
    ),
    "sinking": Limit(
        0.7, "share of the best earlier error that one of the last two runs has to reach",
        "set: half a step of a method of order 1 leaves 0.5; it errs towards a fail. Errors that "
        "never come below it, of the size 1 of the motion, leave the verdict open",
    ),
}  # fmt: skip
