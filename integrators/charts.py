"""How far a chart reaches: translates of a matrix group's Cayley chart, margins, distances.

The Cayley chart g = (e − ξ/2)⁻¹(e + ξ/2) ends where det(e + g) = 0, that is where det(e − ξ/2)
grows without bound. The chart around a translate B holds the g with det(e + g B⁻¹) ≠ 0; a family
of translates whose charts hold the whole group is a cover (paper, section 4.3), and
`MatrixAlgebra.cover` states it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from .errors import BadInput
from .groupoids.lie_group import RetractionGroupoid


def chart_extent(groupoid: Any, u: Any, h: Any) -> Any:
    """What grows without bound towards the chart's edge, symbolic; None where there is no edge.

    det(e − hu/2) for Cayley (1/cos²(θ/2) at a rotation by θ), |hu|² for other retractions.
    """
    if not isinstance(groupoid, RetractionGroupoid):
        return None
    if groupoid.retraction_name != "cayley":
        return sum((h * e) ** 2 for e in u)
    from sympy import eye

    a = groupoid.algebra.hat(h * u) / 2
    return (eye(groupoid.algebra.size) - a).det(method="berkowitz").expand()


def chart_reach(groupoid: Any) -> int:
    """The extent at which a chart is left: twice what a cover leaves at most.

    Some translate has det(e + g B⁻¹) ≥ 2 (4 on SE(n), whose last diagonal entry is always 1), and
    det(e − ξ/2) det(e + τ(ξ)) = 2ᴺ. Twice, so that a trajectory near the limit does not change
    charts at every step. For other retractions a rotation by half a turn.
    """
    if groupoid.retraction_name == "cayley" and hasattr(groupoid, "algebra"):
        return int(2**groupoid.algebra.size)
    return 10


@dataclass(frozen=True)
class Position:
    """Where an arrow lies in its chart.

    inside: whether the chart's symmetric neighbourhood holds it; distance: to the chart's edge
    (infinite where there is none; None where the groupoid does not know it); condition_L,
    condition_R: condition numbers of L and R; margin: 1 at the identities, 0 at the edge.

    Cayley: distance = smallest singular value of e + g (the spectral norm of the least change of g
    that leaves the chart), margin = that over the largest, cos(θ/2) at a rotation by θ.
    Exponential: distance = 2π − the largest |Im λ| of ad_ξ, margin = that over 2π. Else the margin
    is the inverse of the larger condition number.
    """

    inside: bool
    distance: float | None
    margin: float
    condition_L: float
    condition_R: float


def position(groupoid: Any, L: Any, R: Any, xi: Any) -> Position:
    """The position of an arrow with these L, R (m×m) and ξ = hu, in double precision."""
    conditions = [float(np.linalg.cond(np.asarray(e, dtype=float))) for e in (L, R)]
    found = distance_and_margin(groupoid, xi)
    if found is None:
        known = groupoid.kind == "pair"
        worst = 1 / max(conditions)
        return Position(worst > 0, math.inf if known else None, worst, *conditions)
    return Position(found[0] > 0, *found, *conditions)


def distance_and_margin(groupoid: Any, xi: Any) -> tuple[float, float] | None:
    """(distance, margin) of `Position` at ξ = hu; None where the groupoid has no such chart."""
    if not isinstance(groupoid, RetractionGroupoid):
        return None
    xi, algebra = np.asarray(xi, dtype=float), groupoid.algebra
    if groupoid.retraction_name == "cayley":
        kind = complex if algebra._complex else float
        basis = np.array(algebra.basis, dtype=kind)
        sizes = np.linalg.svd(np.eye(algebra.size) - np.tensordot(xi, basis, 1) / 2)[1]
        return float(2 / sizes[0]), float(sizes[-1] / sizes[0])  # e + g = 2 (e − ξ/2)⁻¹
    constants = [np.array(c.tolist(), dtype=float) for c in algebra.structure_constants]
    ad = np.array([[xi @ c[:, nu] for nu in range(algebra.dim)] for c in constants])
    distance = 2 * math.pi - float(max(abs(np.linalg.eigvals(ad).imag)))
    return distance, max(0.0, distance / (2 * math.pi))


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
        return self.array([[int(i == j) for j in range(self.size)] for i in range(self.size)])

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
        return abs(determinant(self.e + g @ self.translates[translate][1]))

    def best(self, g: np.ndarray) -> int:
        """The translate whose chart holds g farthest from its edge (I and J of section 4.3)."""
        return int(np.argmax([self.openness(g, J) for J in range(len(self.translates))]))


def determinant(matrix: np.ndarray) -> Any:
    """det by elimination with row exchanges, in any arithmetic."""
    if matrix.dtype == np.float64:
        return np.linalg.det(matrix)
    a, result = matrix.copy(), 1
    for p in range(len(a)):
        row = max(range(p, len(a)), key=lambda i: abs(a[i, p]))
        if a[row, p] == 0:
            return 0 * a[row, p]
        if row != p:
            a[[p, row]] = a[[row, p]]
            result = -result
        result = result * a[p, p]
        for i in range(p + 1, len(a)):
            a[i, p:] = a[i, p:] - a[i, p] / a[p, p] * a[p, p:]
    return result
