"""A test of many matrices at once for membership in a group."""

from __future__ import annotations

import numpy as np

from ...algebras import MatrixAlgebra

#: tolerance, relative to 1 and the largest entry of a column: half of a double's digits, as in
#: `StepContext.coordinates`; rows of a long run stay far below it
OFF = 2.0**-32
#: least |det(e + g B⁻¹)| for which the coordinates of Cayley's chart have digits to compare
OPEN = 2.0**-10


def strangers(algebra: MatrixAlgebra, g: np.ndarray) -> np.ndarray:
    """Return the indices of the matrices g (N, k, k) that are not elements of the algebra's group.

    An element is τ(ξ)B, where τ is Cayley's map and B a translate of the algebra. If the algebra
    has no cover, elements at the edge of the chart at e are accepted; if τ does not fit it, all
    are.
    """
    if not algebra.closed_under_triple_products:
        return np.zeros(0, dtype=np.int64)
    k, e = algebra.size, np.eye(algebra.size)
    basis = np.array(algebra.basis, dtype=np.float64).reshape(algebra.dim, k * k)
    within = np.linalg.pinv(basis) @ basis
    cover = np.array(algebra.translates, dtype=np.float64)
    openness = np.array([abs(np.linalg.det(e + g @ np.linalg.inv(B))) for B in cover])
    best = openness.argmax(axis=0)
    reached = openness.max(axis=0) > OPEN
    B = cover[best[reached]]
    moved = g[reached] @ np.linalg.inv(B)
    half = (moved - e) @ np.linalg.inv(moved + e)  # ξ^/2, if it is an element
    half = (half.reshape(-1, k * k) @ within).reshape(-1, k, k)
    off = np.full(len(g), np.inf if algebra.cover else 0.0)
    sizes = 1 + abs(g[reached]).max(axis=1, initial=0, keepdims=True)
    # (e − ξ^/2) g = (e + ξ^/2) B, without an inverse that a matrix outside the group may lack
    off[reached] = (abs((e - half) @ g[reached] - (e + half) @ B) / sizes).max(axis=(1, 2))
    return np.flatnonzero(~(off <= OFF))
