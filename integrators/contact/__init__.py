"""Unilateral contact with friction: gaps φ(x) ≥ 0, Coulomb's cones, impacts, steps under them."""

from .cones import NOT_FOUND, ROUNDED, SWEEPS
from .contact_step import LEFT_OVER, ZENO, ContactSteps, FreeSteps, Impact, Moment
from .gaps import TOUCHING, Gaps, gap_expressions
from .impacts import AGAIN, NOISE, STAGNANT
from .located_step import LocatedSteps
from .start import check_gaps, opposed

__all__ = [
    "AGAIN", "ContactSteps", "FreeSteps", "Gaps", "Impact", "LEFT_OVER", "LocatedSteps", "Moment",
    "NOISE", "NOT_FOUND", "ROUNDED", "STAGNANT", "SWEEPS", "TOUCHING", "ZENO", "check_gaps",
    "gap_expressions", "opposed",
]  # fmt: skip
