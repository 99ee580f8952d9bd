"""The limits of optimal control; orders have those of the study of orders."""

from ..core.limits import Limit

LIMITS = {
    "grows": Limit(
        1.2, "factor between changes of the controls, twice, where nothing converges",
        "derived: what converges changes by 2⁻ᵖ of the change before, what does not by 1 or more; "
        "it errs towards a verdict by the orders",
    ),
}  # fmt: skip
