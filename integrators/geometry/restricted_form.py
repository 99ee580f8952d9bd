"""The symplectic form on the arrows that satisfy holonomic constraints, which may move.

The change of ω in a step is that of `forced_form`. With constraints the form is preserved on
exactly the vectors with A b = 0 and d(A ξ − a) = 0, at the time of each end (Marsden, West 2001,
3.5.3).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..equations import SceneSymbols, constraint_matrix, constraint_shift, mass_matrix, momentum
from ..numbers import Arithmetic, jacobian, numeric
from ..numbers.types import Function, Matrix, Number, Vector
from .defects import in_round_offs
from .forced_form import form_change
from .step_map import StepMap


def restricted_defect(
    geometry: StepMap,
    x: Vector,
    mu: Vector,
    start: Vector,
    sign: int = 1,
    forced: bool = False,
) -> Number:
    """Return the defect of ω under the step from (x, μ), on the vectors that the constraints admit.

    It is the largest entry of |Nᵀ(Pᵀ ω′ P − ω)N| over |N|ᵀ(|P|ᵀ|ω′||P| + |ω|)|N|, where N is a
    basis of these vectors; it does not depend on units. start: Newton's start. sign = −1 flips the
    bracket: a negative control. forced: True if the change should be −dθ_f, with the scene's force
    (`forced_form`).
    """
    numbers, m = geometry.numbers, geometry.m
    u = geometry.unknowns(x, mu, start)[:m]
    xi = geometry.velocities(x[None], mu[None], u[None])[0]
    A, turning, mass, moved, rho = _parts(geometry.equations.s, numbers)(x, xi, geometry.q)
    # A b = 0, and d(A ξ − a) = 0 with M dξ = δμ − ∂p/∂x δx
    of_xi = numbers.solve(mass, np.hstack([-moved @ rho, numbers.identity(m)]))
    still = numbers.zeros(len(A), m)
    conditions = np.vstack([np.hstack([A, still]), np.hstack([turning @ rho, still]) + A @ of_xi])
    N = _null_space(numbers, conditions)
    gap, terms = form_change(geometry, x, mu, start, sign, forced).gap()
    scale = abs(N).T @ terms @ abs(N)
    return in_round_offs((N.T @ gap.value @ N).ravel(), scale.ravel())


def _null_space(numbers: Arithmetic, matrix: Matrix) -> Matrix:
    """Return a basis of {v: matrix v = 0}, where matrix = (A 0; B C) and v = (b, δ).

    The columns that elimination solves for are chosen in doubles, equally many of A and of C, which
    have different units.
    """
    from scipy.linalg import qr

    solved: list[int] = []
    count, size = matrix.shape
    rows, columns = count // 2, size // 2
    for part in (matrix[:rows, :columns], matrix[rows:, columns:]):
        natural = np.asarray(part / max(abs(part).ravel()), dtype=float)
        order = qr(natural, mode="r", pivoting=True)[1]
        solved += [len(solved) // rows * columns + i for i in order[:rows].tolist()]
    free = [i for i in range(size) if i not in solved]
    basis = numbers.zeros(size, size - count)
    basis[solved] = -numbers.solve(matrix[:, solved], matrix[:, free])
    basis[free] = numbers.identity(size - count)
    return basis


@lru_cache(maxsize=64)
def _parts(s: SceneSymbols, numbers: Arithmetic) -> Function:
    """Return a function of (x, ξ): A, ∂(Aξ − a)/∂x, ∂²l/∂ξ², ∂²l/∂ξ∂x and ρ̂."""
    A, g, h = constraint_matrix(s, s.x), s.groupoid, s.h
    turning = jacobian(A * s.u - constraint_shift(s, s.x), s.x)
    parts = [A, turning, mass_matrix(s), jacobian(momentum(s), s.x), g.rho(s.x, h) / h]
    return numeric({"x": s.x, "u": s.u, "q": s.q}, parts, numbers)
