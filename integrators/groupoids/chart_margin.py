"""The symmetric neighbourhood around the identities: where it ends, and how near an arrow is.

The chart of a matrix group ends where its retraction ceases to be a local diffeomorphism: each
retraction says where (`Retraction.extents`, `reach`, `distance_and_margin`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import BadInput
from ..numbers import evaluate_matrix, exact, exact_vector, sympy, to_sympy


def chart_extents(groupoid: Any, x: Any, u: Any, h: Any) -> list[tuple[str, Any]]:
    """What tells how near the chart's edges an arrow is, symbolic (`Retraction.extents`).

    Nothing where there is no edge.
    """
    found = [
        extent
        for group, xi in groupoid.group_parts(x, u, h)
        for extent in group.tau.extents(group.algebra, xi)
    ]
    return [(kind, value) for kind, value in found if value.free_symbols]


def chart_reach(groupoid: Any) -> float:
    """The size (`chart_extents`) at which a chart is left (`Retraction.reach`)."""
    groups = groupoid.matrix_groups()
    return min((group.tau.reach(group.algebra) for group in groups), default=math.inf)


def margin_of(size: Any) -> float:
    """The margin of a step of that size: cos(θ/2) for Cayley, 1 − (ϑ/2π)² for the exponential."""
    return 1.0 if size <= 1 else float(1 / size**0.5)


@dataclass(frozen=True)
class Position:
    """Where an arrow lies in its chart.

    inside: whether the chart's symmetric neighbourhood holds it; distance: to the chart's edge
    (infinite where there is none; None where the groupoid does not know it); condition_L,
    condition_R: condition numbers of L and R; margin: 1 at the identities, 0 at the edge.

    Distance and margin are the retraction's (`distance_and_margin`), of a product the least of its
    parts. Where no group takes part, the margin is the inverse of the larger condition number.
    """

    inside: bool
    distance: float | None
    margin: float
    condition_L: float
    condition_R: float


def position(groupoid: Any, x: Any, u: Any, h: Any) -> Position:
    """The position of the arrow (x, u) at step h; `Groupoid.position` says the rest."""
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
        found = [
            group.tau.distance_and_margin(group.algebra, numbers(xi)[:, 0])
            for group, xi in groupoid.group_parts(*at, step)
        ]
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):  # the maps have no value there
        return Position(False, 0.0, 0.0, math.inf, math.inf)
    if found:
        distance, margin = (min(values) for values in zip(*found, strict=True))
        return Position(distance > 0, distance, margin, *conditions)
    worst = max(conditions)
    margin = 1 / worst if worst < 2.0**53 else 0.0  # beyond, u has no digits left
    return Position(margin > 0, math.inf if groupoid.kind == "pair" else None, margin, *conditions)
