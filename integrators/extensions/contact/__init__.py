"""Unilateral contact with friction: gaps φ(x) ≥ 0, Coulomb's cones, impacts, steps."""

from .cones import Cones, NotFound, length, scaling
from .contact_flow import ContactFlow, ContactRun, Impacts
from .contact_step import ZENO, ContactSteps, Impact, Moment
from .gaps import BESIDE, TOUCHING, Gaps, Place, gap_expressions, gap_functions, motion_functions
from .located_step import LocatedSteps
from .start import check_gaps, opposed, scaled_gaps, unsure_gaps

__all__ = [
    "BESIDE", "Cones", "ContactFlow", "ContactRun", "ContactSteps", "Gaps", "Impact",
    "Impacts", "LocatedSteps", "Moment", "NotFound", "Place", "TOUCHING", "ZENO",
    "check_gaps", "gap_expressions", "gap_functions", "length", "motion_functions", "opposed",
    "scaled_gaps", "scaling", "unsure_gaps",
]  # fmt: skip
