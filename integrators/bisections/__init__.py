"""Section 4 of the paper: bisections, translations, the general evolution operator, covers."""

from .bisection import Bisection
from .edge_policies import POLICIES, Bisect, EdgePolicy, Solution
from .evolution_operator import EvolutionOperator

__all__ = [
    "Bisect", "Bisection", "EdgePolicy", "EvolutionOperator", "POLICIES", "Solution",
]  # fmt: skip
