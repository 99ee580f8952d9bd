"""The symplectic form on the arrows that a holonomic constraint leaves.

On the dual, (b, δμ) with δx = ρ̂ b is a tangent vector of the prolongation, and

    ω((b, δ), (b′, δ′)) = b·δ′ − b′·δ + μ_θ Ĉ^θ_{γν} b^γ b′^ν.

A step takes b at its start to b′ at its end, the displacement of the arrow (x, u) between by
a = −b/h and c = b′/h: h δu + R b = L b′. Under constraints the form is kept on the vectors with
A b = 0 and d(A ξ) = 0 (Marsden, West 2001, 3.5.3), and on no others.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ..equations import SceneSymbols, constraint_matrix, mass_matrix, momentum
from ..numbers import Arithmetic, jacobian, numeric
from ..numbers.types import Matrix, Number, Vector
from .forced_form import canonical_form, work_differential
from .local_geometry import LocalGeometry
from .one_step_geometry import OneStepGeometry


def restricted_defect(
    geometry: OneStepGeometry,
    x: Vector,
    mu: Vector,
    start: Vector,
    sign: int = 1,
    forced: bool = False,
) -> Number:
    """‖Nᵀ(Pᵀ ω′ P − ω)N‖ / (‖P N‖²‖ω‖) of the step from (x, μ), N a basis of the vectors left.

    start: where Newton starts. sign = −1 flips the bracket: a control. forced: the change is to be
    −dθ_f, of the scene's force (`forced_form`).
    """
    numbers, (n, m) = geometry.numbers, (geometry.n, geometry.m)
    w, (_, slope, rows_z, grown, by_w, by_z) = geometry.solved(x, mu, start)
    along = -numbers.solve(slope, rows_z)
    after = numbers.identity(n + m) + by_z + by_w @ along
    f = _parts(geometry.equations.s, numbers)
    xi = geometry.velocities(x[None], mu[None], w[None, :m])[0]
    A, turning, mass, moved, rho, *_ = f(x, xi, geometry.q)
    *_, L, R = f(x, w[:m], geometry.q)
    zero, one = numbers.zeros, numbers.identity(m)
    lift = np.block([[rho, zero(n, m)], [zero(m, m), one]])
    displaced = geometry.q[0] * (along[:m] @ lift) + np.hstack([R, zero(m, m)])
    P = np.vstack([numbers.solve(L, displaced), (after @ lift)[n:]])
    # A b = 0, and d(A ξ) = 0 with M dξ = δμ − ∂p/∂x δx
    of_xi = numbers.solve(mass, np.hstack([-moved, one])) @ lift
    held = np.vstack([np.hstack([A, zero(len(A), m)]), turning @ lift[:n] + A @ of_xi])
    N = _null_space(numbers, held)

    before = canonical_form(geometry, x, mu, sign).value
    after_x, after_mu = x + grown[:n], mu + grown[n:]
    gap = P.T @ canonical_form(geometry, after_x, after_mu, sign).value @ P - before
    if forced:
        free = LocalGeometry(geometry.equations.discrete, numbers, geometry.q)
        here = free.at(x, w[:m])
        arrow = np.vstack([-np.hstack([one, zero(m, m)]), P[:m]]) / geometry.q[0]
        gap = gap + arrow.T @ work_differential(free, x, w[:m], here).value @ arrow
    gap = N.T @ gap @ N
    norms = [sum(e * e for e in part.ravel()) for part in (gap, P @ N, before)]
    return norms[0] ** 0.5 / (norms[1] * norms[2] ** 0.5)


def _null_space(numbers: Arithmetic, held: Matrix) -> Matrix:
    """A basis of {v: held v = 0}: the columns that elimination solves for are chosen in doubles."""
    from scipy.linalg import qr

    count, size = held.shape
    order = qr(np.asarray(held, dtype=float), mode="r", pivoting=True)[1]
    solved, free = order[:count], order[count:]
    basis = numbers.zeros(size, size - count)
    basis[solved] = -numbers.solve(held[:, solved], held[:, free])
    basis[free] = numbers.identity(size - count)
    return basis


@lru_cache(maxsize=64)
def _parts(s: SceneSymbols, numbers: Arithmetic) -> Any:
    """A, ∂(Aξ)/∂x, ∂²l/∂ξ², ∂²l/∂ξ∂x, ρ̂, L and R at (x, u)."""
    A, g, h = constraint_matrix(s, s.x), s.groupoid, s.h
    parts = [A, jacobian(A * s.u, s.x), mass_matrix(s), jacobian(momentum(s), s.x),
             g.rho(s.x, h) / h, g.L(s.x, s.u, h), g.R(s.x, s.u, h)]  # fmt: skip
    return numeric({"x": s.x, "u": s.u, "q": s.q}, parts, numbers)
