"""What measuring asks of the limits of contact: which rises and times are more than round-off."""

from __future__ import annotations

from collections.abc import Sequence

from ..core.decisions import decision
from ..symplecticity.limits import limit
from .limits import LIMITS


@decision
def asks_finer(rises: Sequence[float], digits: int) -> bool:
    """True if a rise of the energy is more than round-off, and has not fallen with the step."""
    fell = len(rises) > 1 and rises[-1] <= rises[0] / LIMITS["falls"]
    return rises[0] > limit(digits) and not fell


@decision
def is_round_off(error: float, size: float, unsure: float, digits: int) -> bool:
    """True for an error of times of such a size that have no order."""
    return error <= max(10 * limit(digits) * size, unsure)
