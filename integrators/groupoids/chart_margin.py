"""The chart 𝒰 around the identities: its edge, and the distance of an arrow from it.

The chart of a matrix group ends where its retraction ceases to be a local diffeomorphism; each
retraction gives this edge (`Retraction.extents`, `reach`, `distance_and_margin`). The products of
arrows in the symmetric neighbourhood 𝒲 ⊂ 𝒰 lie in 𝒰 (paper, Proposition 3.1;
`Retraction.is_symmetric`). On M × G it consists of all arrows whose group element lies in that of
G, on pairs of all arrows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import BadInput
from ..numbers import evaluate_matrix, exact, exact_vector, sympy, to_sympy
from ..numbers.types import Column, Given, GivenVector, Number, SymbolicMatrix
from .axioms import check_axioms


def margin_of(size: Number) -> float:
    """Return the margin of a step's size: cos(θ/2) for Cayley, 1 − (ϑ/2π)² for the exponential."""
    return 1.0 if size <= 1 else float(1 / size**0.5)


@dataclass(frozen=True)
class Position:
    """The position of an arrow in its chart.

    inside: True if it lies in the chart 𝒰; distance: to the chart's edge (infinite without an edge;
    None if the groupoid does not know it); condition_L, condition_R: condition numbers of L and R;
    margin: 1 at the identities, 0 at the edge; symmetric: True if it lies in the symmetric
    neighbourhood 𝒲, where any two arrows have their product in 𝒰 (None if it is unknown).

    Distance and margin come from the retraction (`distance_and_margin`); for a product they are the
    least of its parts. For a `LocalGroupoid` the margin is the inverse of the larger condition
    number.
    """

    inside: bool
    distance: float | None
    margin: float
    condition_L: float
    condition_R: float
    symmetric: bool | None = None


def position(groupoid: Any, x: GivenVector, u: GivenVector, h: Given) -> Position:
    """Return the position of the arrow (x, u) in its chart, at the step h.

    x: n numbers, u: m numbers; a float is its binary value. Raises `BadInput` for other shapes,
    values that are not numbers, a step of 0, and maps that are no groupoid (`check_axioms`).
    """
    check_axioms(groupoid)
    step = to_sympy(exact(h, "the step"))
    if step == 0:
        raise BadInput("a step of 0 goes nowhere: give a positive or negative step.")

    def column(values: GivenVector, length: int, name: str) -> Column:
        entries = exact_vector(values, length, f"{groupoid.name}: {name}")
        return sympy.Matrix(length, 1, list(map(to_sympy, entries)))

    def numbers(matrix: SymbolicMatrix) -> np.ndarray:
        return np.array(evaluate_matrix(matrix, 20).tolist(), dtype=float).reshape(matrix.shape)

    at = column(x, groupoid.dim_x, "x"), column(u, groupoid.dim_u, "u")
    try:
        left, right = (
            float(np.linalg.cond(numbers(f(*at, step)))) for f in (groupoid.L, groupoid.R)
        )
        parts = [(group, numbers(xi)[:, 0]) for group, xi in groupoid.group_parts(*at, step)]
        edges = [group.tau.distance_and_margin(group.algebra, xi) for group, xi in parts]
        symmetric = [group.tau.is_symmetric(group.algebra, xi) for group, xi in parts]
    except (ArithmeticError, TypeError, ValueError):  # the maps have no real value there
        return Position(False, 0.0, 0.0, math.inf, math.inf, False)
    worst = max(left, right)
    unknown = 1 / worst if worst < 2.0**53 else 0.0  # beyond, u has no digits left
    distance, margin = (min(values) for values in zip((math.inf, 1.0), *edges, strict=True))
    if _has_unknown_edge(groupoid):
        return Position(min(distance, unknown) > 0, None, min(margin, unknown), left, right)
    known = None if None in symmetric and False not in symmetric else all(symmetric)
    return Position(distance > 0, distance, margin, left, right, known)


def _has_unknown_edge(groupoid: Any) -> bool:
    return groupoid.by_maps or any(map(_has_unknown_edge, groupoid.parts))
