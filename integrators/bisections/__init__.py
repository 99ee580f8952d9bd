"""Section 4 of the paper: bisections, translations, the general evolution operator, covers."""

from .bisection import Bisection
from .edge_policies import POLICIES, Bisect, EdgePolicy
from .evolution_operator import EvolutionOperator
from .step_context import StepContext
from .translates import Solution

__all__ = [
    "Bisect", "Bisection", "EdgePolicy", "EvolutionOperator", "POLICIES", "Solution",
    "StepContext",
]  # fmt: skip
