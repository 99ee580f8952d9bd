"""Unilateral contact with friction: gaps φ(x) ≥ 0, Coulomb's cones, impacts, steps under them."""

from .contact_step import ZENO, ContactSteps, FreeSteps, Impact, Moment
from .gaps import Gaps, gap_expressions
from .located_step import LocatedSteps
from .start import check_gaps

__all__ = [
    "ContactSteps", "FreeSteps", "Gaps", "Impact", "LocatedSteps", "Moment", "ZENO", "check_gaps",
    "gap_expressions",
]  # fmt: skip
