"""Section 4 of the paper: bisections, translations, the general evolution operator, covers."""

from .bisection import Bisection
from .evolution_operator import EvolutionOperator

__all__ = ["Bisection", "EvolutionOperator"]
