"""Reference solutions to any number of digits, each with the digits that are certain and why.

>>> from reference import solution
>>> s = solution("pendulum", 10, digits=50)
>>> s.x, s.mu, s.certain_digits, s.certainty, s.evidence
"""

from .answer.result import Solution
from .answer.solution import (
    follow,
    many_motions,
    multiplier_sizes,
    multipliers,
    solution,
    solutions,
    surroundings,
)
from .failures import MotionEnds, ReferenceFailure
from .progress import progress_to

__all__ = [
    "MotionEnds", "ReferenceFailure", "Solution", "follow", "many_motions", "multiplier_sizes",
    "multipliers",
    "progress_to", "solution", "solutions", "surroundings",
]  # fmt: skip
