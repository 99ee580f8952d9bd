"""The symmetric neighbourhood around the identities: where it ends, and how near an arrow is.

The chart of a matrix group ends where its retraction ceases to be a local diffeomorphism. Cayley's
g = (e − ξ/2)⁻¹(e + ξ/2) ends where det(e + g) = 0, that is where det(e − ξ/2) grows without bound.
The exponential ends where ad_ξ has the eigenvalue 2πi, for there dexp_ξ is singular. On SO(3) that
is a whole turn; from half a turn on ξ and a shorter one about the opposite axis are the same
rotation, and ξ tells apart elements of the covering group.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import BadInput
from ..numbers.lazy import sympy

if TYPE_CHECKING:
    from .groupoid import Groupoid


def chart_extents(groupoid: Groupoid, x: Any, u: Any, h: Any) -> list[tuple[str, Any]]:
    """What tells how near the chart's edges an arrow is, symbolic: (kind, value) each.

    "size": 1 at the identities, its absolute value grows without bound towards the edge:
    det(e − ξ/2) for Cayley, 1/cos²(θ/2) at a rotation by θ. "rest": 1 at the identities, 0 at the
    edge, negative beyond: 1 − (ϑ/2π)² for the exponential, where ±iϑ are eigenvalues of ad_ξ. With
    closed forms (`retractions.turning`) ϑ is the rate of each ideal; elsewhere it is bounded by
    the skew part of ad_ξ, |ϑ|² ≤ ½‖(ad − adᵀ)/2‖²_F. Nothing where there is no edge.
    """
    found: list[tuple[str, Any]] = []
    for group, xi in groupoid.group_parts(x, u, h):
        if group.retraction_name == "cayley":
            found.append(("size", _cayley_extent(group.algebra, xi)))
        else:
            found += [("rest", 1 - square) for square in _squared_turns(group.algebra, xi)]
    return [(kind, value) for kind, value in found if value.free_symbols]


def _cayley_extent(algebra: Any, xi: Any) -> Any:
    return (sympy.eye(algebra.size) - algebra.hat(xi) / 2).det(method="berkowitz").expand()


def _squared_turns(algebra: Any, xi: Any) -> list[Any]:
    """(ϑ/2π)² at ξ, of each ideal that turns at one rate; else one bound of all."""
    from ..retractions.ad_spectrum import turnings

    if parts := turnings(algebra):
        squares = [part.squared_rate(xi) for part in parts]
    else:
        ad = algebra.ad(xi)
        squares = [sum(e**2 for e in (ad - ad.T) / 2).expand() / 2]
    return [square / (4 * sympy.pi**2) for square in squares]


def chart_reach(groupoid: Groupoid) -> float:
    """The size (`chart_extents`) at which a chart is left: twice what a cover leaves at most.

    Some translate has det(e + g B⁻¹) ≥ 2 (4 on SE(n), whose last diagonal entry is always 1), and
    det(e − ξ/2) det(e + τ(ξ)) = 2ᴺ. Twice, so that a trajectory near the limit does not change
    charts at every step. For the exponential ϑ = π, where it ceases to be injective on SO(3).
    """
    reaches = (
        2.0**group.algebra.size if group.retraction_name == "cayley" else 16 / 9
        for group in groupoid.matrix_groups()
    )
    return min(reaches, default=math.inf)


def margin_of(size: Any) -> float:
    """The margin of a step of that size: cos(θ/2) for Cayley, 1 − (ϑ/2π)² for the exponential."""
    return 1.0 if size <= 1 else float(1 / size**0.5)


@dataclass(frozen=True)
class Position:
    """Where an arrow lies in its chart.

    inside: whether the chart's symmetric neighbourhood holds it; distance: to the chart's edge
    (infinite where there is none; None where the groupoid does not know it); condition_L,
    condition_R: condition numbers of L and R; margin: 1 at the identities, 0 at the edge.

    Cayley: distance = smallest singular value of e + g (the spectral norm of the least change of g
    that leaves the chart), margin = |det(e + g)/2ᴺ|^½ or 1 if that is less, cos(θ/2) on SO(3) at a
    rotation by θ. Exponential: distance = 2π − ϑ, ϑ the largest |Im λ| of ad_ξ, margin =
    1 − (ϑ/2π)² (0 beyond). Of a product the least of its parts. Else, where no group takes part,
    the margin is the inverse of the larger condition number.
    """

    inside: bool
    distance: float | None
    margin: float
    condition_L: float
    condition_R: float


def position(groupoid: Groupoid, x: Any, u: Any, h: Any) -> Position:
    """The position of the arrow (x, u) at step h; `Groupoid.position` says the rest."""
    from ..numbers.evaluation import evaluate_matrix
    from ..numbers.exact import exact, exact_vector, to_sympy

    step = to_sympy(exact(h, "the step"))
    if step == 0:
        raise BadInput("a step of 0 goes nowhere: give a positive or negative step.")

    def column(values: Any, length: int, name: str) -> Any:
        exact_values = exact_vector(values, length, f"{groupoid.name}: {name}")
        return sympy.Matrix(length, 1, [to_sympy(e) for e in exact_values])

    def numbers(matrix: Any) -> np.ndarray:
        return np.array(evaluate_matrix(matrix, 20).tolist(), dtype=float).reshape(matrix.shape)

    at = column(x, groupoid.dim_x, "x"), column(u, groupoid.dim_u, "u")
    try:
        conditions = [
            float(np.linalg.cond(numbers(f(*at, step)))) for f in (groupoid.L, groupoid.R)
        ]
        parts = [(group, numbers(xi)[:, 0]) for group, xi in groupoid.group_parts(*at, step)]
        found = [_distance_and_margin(group, xi) for group, xi in parts]
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):  # the maps have no value there
        return Position(False, 0.0, 0.0, math.inf, math.inf)
    if found:
        distance, margin = (min(values) for values in zip(*found, strict=True))
        return Position(distance > 0, distance, margin, *conditions)
    worst = max(conditions)
    margin = 1 / worst if worst < 2.0**53 else 0.0
    return Position(margin > 0, math.inf if groupoid.kind == "pair" else None, margin, *conditions)


def _distance_and_margin(group: Any, xi: np.ndarray) -> tuple[float, float]:
    """(distance, margin) of `Position` at ξ = hu in the chart of a matrix group."""
    algebra = group.algebra
    if group.retraction_name == "cayley":
        basis = np.array(algebra.basis, dtype=complex if algebra._complex else float)
        near = np.eye(algebra.size) - np.tensordot(xi, basis, 1) / 2  # e + g = 2 (e − ξ/2)⁻¹
        return 2 / float(np.linalg.norm(near, 2)), margin_of(abs(np.linalg.det(near)))
    constants = [np.array(c.tolist(), dtype=float) for c in algebra.structure_constants]
    ad = np.array([[xi @ c[:, nu] for nu in range(algebra.dim)] for c in constants])
    turn = float(max(abs(np.linalg.eigvals(ad).imag)))
    return 2 * math.pi - turn, max(0.0, 1 - (turn / (2 * math.pi)) ** 2)
