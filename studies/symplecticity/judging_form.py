"""What measuring asks of the limit of a form: which defects of programs are more than round-off."""

from __future__ import annotations

from ..core.decisions import decision
from .limits import LIMITS


@decision
def rounded(unit: float) -> float:
    """Return the defect that the round-off inside of a step may leave; unit: the program's own.

    The error of a step's own operations is a smooth function of the state if it comes from rounded
    constants or an iteration's last correction, so that differences take it for the map's
    (rebound's SABA4 shows 3e-14). Formulas have the same limit.
    """
    return LIMITS["form"] * unit / 2.0**-53


@decision
def is_defect(defect: float, unit: float, steps: int = 1) -> bool:
    """True for a defect of so many steps that is more than they round."""
    return defect > rounded(unit) * steps
