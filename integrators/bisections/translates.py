"""A matrix group's Cayley chart and its translates (paper, section 4.3).

The chart around a translate B holds the g with det(e + g B⁻¹) ≠ 0; a family of translates whose
charts hold the whole group is a cover, and `MatrixAlgebra.cover` states it.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from ..errors import BadInput
from ..groupoids.lie_group import RetractionGroupoid


class GroupChart:
    """A matrix group's Cayley chart and its translates, in one arithmetic.

    Raises `BadInput` for another retraction or complex matrices.
    """

    def __init__(self, groupoid: Any, numbers: Any) -> None:
        if not isinstance(groupoid, RetractionGroupoid) or groupoid.algebra._complex:
            raise BadInput(f"{groupoid.name} is no real matrix group: it has no translates.")
        if groupoid.retraction_name != "cayley":
            raise BadInput(
                f"{groupoid.name}: bisections continue the Cayley chart; write retraction=cayley."
            )
        self.algebra, self.numbers = groupoid.algebra, numbers
        self.size, self.m = self.algebra.size, self.algebra.dim

    def array(self, rows: Any) -> np.ndarray:
        """A matrix of exact entries in this arithmetic."""
        number = self.numbers.number
        return np.array([[number(e) for e in row] for row in rows], dtype=self.numbers.dtype)

    @cached_property
    def e(self) -> np.ndarray:
        """The identity, N×N."""
        return np.asarray(self.numbers.identity(self.size))

    @cached_property
    def translates(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """(B, B⁻¹) of the cover; the first is (e, e)."""
        family = [self.array(B) for B in self.algebra.translates]
        return [(B, self.numbers.solve(B, self.e)) for B in family]

    @cached_property
    def _basis(self) -> np.ndarray:
        return np.array([self.array(e) for e in self.algebra.basis], dtype=self.numbers.dtype)

    @cached_property
    def _dual(self) -> np.ndarray:
        return self.array(self.algebra.dual.tolist())

    def hat(self, xi: Any) -> np.ndarray:
        """ξ^γ e_γ, N×N."""
        return np.asarray(sum(c * e for c, e in zip(xi, self._basis, strict=True)))

    def element(self, xi: Any, translate: int = 0) -> np.ndarray:
        """τ(ξ) B, N×N."""
        a = self.hat(xi) / 2
        return np.asarray(
            self.numbers.solve(self.e - a, self.e + a) @ self.translates[translate][0]
        )

    def coordinates(self, g: np.ndarray, translate: int = 0) -> np.ndarray:
        """ξ with g = τ(ξ) B, m; raises `ZeroDivisionError` at the chart's edge."""
        g = g @ self.translates[translate][1]
        a = self.numbers.solve((self.e + g).T, (g - self.e).T).T
        return np.asarray(2 * (self._dual @ a.ravel()))

    def openness(self, g: np.ndarray, translate: int = 0) -> Any:
        """|det(e + g B⁻¹)|: 0 at the edge of that chart."""
        return abs(self.numbers.det(self.e + g @ self.translates[translate][1]))

    def best(self, g: np.ndarray) -> int:
        """The translate whose chart holds g farthest from its edge (I and J of section 4.3)."""
        return int(np.argmax([self.openness(g, J) for J in range(len(self.translates))]))
