"""A matrix group's Cayley chart and its translates (paper, section 4.3).

The chart around a translate B is {g : det(e + g B⁻¹) ≠ 0}; a family of translates whose charts
together contain the whole group is a cover, given by `MatrixAlgebra.cover`.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..errors import BadInput
from ..numbers import Arithmetic
from ..numbers.types import Matrix, Number, Numbers, Vector
from ..retractions import AlgebraInNumbers
from .groupoid import Groupoid
from .lie_group import RetractionGroupoid


class GroupChart(AlgebraInNumbers):
    """A matrix group's chart and its translates, in one arithmetic.

    Raises `BadInput` for a retraction without translates or complex matrices.
    """

    def __init__(self, groupoid: Groupoid, numbers: Arithmetic) -> None:
        if not isinstance(groupoid, RetractionGroupoid) or groupoid.algebra.is_complex:
            raise BadInput(
                f"{groupoid.name} has no real group elements: these are of lie_group(...) and "
                "action(...) with real matrices, such as su(2).real."
            )
        self.tau = groupoid.tau
        if not self.tau.has_translates:
            raise BadInput(
                f"{groupoid.name}: bisections continue the Cayley chart; write retraction=cayley."
            )
        super().__init__(groupoid.algebra, numbers)
        self.size, self.m = self.algebra.size, self.algebra.dim

    @cached_property
    def translates(self) -> list[tuple[Matrix, Matrix]]:
        """The pairs (B, B⁻¹) of the cover; the first is (e, e)."""
        family = [self.array(B) for B in self.algebra.translates]
        return [(B, self.numbers.solve(B, self.e)) for B in family]

    def element(self, xi: Numbers, translate: int = 0) -> Matrix:
        """Return τ(ξ) B, N×N."""
        with self.numbers.user_working():  # τ may be a user's
            return np.asarray(self.tau.element_in(self, xi) @ self.translates[translate][0])

    def coordinates(self, g: Matrix, translate: int = 0) -> Vector:
        """Return ξ with g = τ(ξ) B, m numbers; raises `ArithmeticError` at the chart's edge."""
        with self.numbers.user_working():
            return self.tau.coordinates_in(self, g @ self.translates[translate][1])

    def alike(self, g: Matrix, other: Matrix, part: Number, floor: int = 0) -> bool:
        """Return True if two elements differ by at most a part of (floor + |g|), column by column.

        The entries of a column have one unit: those of a translation are lengths, those of a
        rotation have no unit.
        """
        sizes = np.maximum(abs(g), abs(other)).max(axis=0)
        return bool(np.all(abs(g - other) <= part * (floor + sizes)))

    def openness(self, g: Matrix, translate: int = 0) -> Number:
        """Return |det(e + g B⁻¹)|, which is 0 at the edge of that chart."""
        return abs(self.numbers.det(self.e + g @ self.translates[translate][1]))

    def best(self, g: Matrix) -> int:
        """Return the translate whose chart has g farthest from the edge (I, J of section 4.3)."""
        return int(np.argmax([self.openness(g, J) for J in range(len(self.translates))]))
