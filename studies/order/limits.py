"""The limits of orders."""

from ..core.limits import OF_ORDER, Limit

LIMITS = {
    "double precision": Limit(
        0.05, "distance of an order in double precision from the expected one",
        "set: points within 0.012 (log₂) of a line over three halvings tell its slope to 0.008, "
        "and the next power of the step may bend all of them alike; it errs towards a pass, since "
        "a missed condition costs a whole order",
    ),
    "more digits": Limit(
        0.01, "distance of an order with more digits than 16 from the expected one",
        "set: points within 0.005 of a line, without round-off; it errs towards a pass",
    ),
    "unresolved": Limit(
        0.02, "share of the state that errors of the finest run may be",
        "set: larger ones are not yet small, so that no run resolves the motion; it errs towards "
        "inconclusive, and only where single steps have their order",
    ),
    **OF_ORDER,
}  # fmt: skip


def tolerance(digits: int) -> float:
    """Return the largest distance of an order from the expected one, to both sides."""
    return LIMITS["double precision" if digits == 16 else "more digits"]
