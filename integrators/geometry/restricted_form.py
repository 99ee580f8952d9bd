"""The symplectic form on the arrows that satisfy holonomic constraints, which may move.

On the dual, (b, δμ) with δx = ρ̂ b is a tangent vector of the prolongation, and

    ω((b, δ), (b′, δ′)) = b·δ′ − b′·δ + μ_θ Ĉ^θ_{γν} b^γ b′^ν.

A step maps b at its start to b′ at its end; the displacement of its arrow (x, u) is a = −b/h and c
= b′/h: h δu + R b = L b′. With constraints the form is preserved on exactly the vectors with A b =
0 and d(A ξ − a) = 0, at the time of each end (Marsden, West 2001, 3.5.3).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..equations import SceneSymbols, constraint_matrix, constraint_shift, mass_matrix, momentum
from ..numbers import Arithmetic, jacobian, numeric
from ..numbers.types import Function, Matrix, Number, Vector
from .defects import in_round_offs
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
    """Return the defect of ω under the step from (x, μ), on the vectors that the constraints admit.

    It is the largest entry of |Nᵀ(Pᵀ ω′ P − ω)N| over |N|ᵀ(|P|ᵀ|ω′||P| + |ω|)|N|, where N is a
    basis of these vectors; it does not depend on units. start: Newton's start. sign = −1 flips the
    bracket: a negative control. forced: True if the change should be −dθ_f, with the scene's force
    (`forced_form`).
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
    # A b = 0, and d(A ξ − a) = 0 with M dξ = δμ − ∂p/∂x δx
    of_xi = numbers.solve(mass, np.hstack([-moved, one])) @ lift
    held = np.vstack([np.hstack([A, zero(len(A), m)]), turning @ lift[:n] + A @ of_xi])
    N = _null_space(numbers, held)

    before = canonical_form(geometry, x, mu, sign).value
    later = canonical_form(geometry, x + grown[:n], mu + grown[n:], sign).value
    gap = P.T @ later @ P - before
    terms = abs(P).T @ abs(later) @ abs(P) + abs(before)
    if forced:
        free = LocalGeometry(geometry.equations.free, numbers, geometry.q)
        here = free.at(x, w[:m])
        arrow = np.vstack([-np.hstack([one, zero(m, m)]), P[:m]]) / geometry.q[0]
        work = work_differential(free, x, w[:m], here).value
        gap = gap + arrow.T @ work @ arrow
        terms = terms + abs(arrow).T @ abs(work) @ abs(arrow)
    found, scale = N.T @ gap @ N, abs(N).T @ terms @ abs(N)
    return in_round_offs(found.ravel(), scale.ravel())


def _null_space(numbers: Arithmetic, held: Matrix) -> Matrix:
    """Return a basis of {v: held v = 0}, where held = (A 0; B C) and v = (b, δ).

    The columns that elimination solves for are chosen in doubles, equally many of A and of C, which
    have different units.
    """
    from scipy.linalg import qr

    solved: list[int] = []
    count, size = held.shape
    rows, columns = count // 2, size // 2
    for part in (held[:rows, :columns], held[rows:, columns:]):
        natural = np.asarray(part / max(abs(part).ravel()), dtype=float)
        order = qr(natural, mode="r", pivoting=True)[1]
        solved += [len(solved) // rows * columns + i for i in order[:rows].tolist()]
    free = [i for i in range(size) if i not in solved]
    basis = numbers.zeros(size, size - count)
    basis[solved] = -numbers.solve(held[:, solved], held[:, free])
    basis[free] = numbers.identity(size - count)
    return basis


@lru_cache(maxsize=64)
def _parts(s: SceneSymbols, numbers: Arithmetic) -> Function:
    """Return a function of (x, u): A, ∂(Aξ − a)/∂x, ∂²l/∂ξ², ∂²l/∂ξ∂x, ρ̂, L and R."""
    A, g, h = constraint_matrix(s, s.x), s.groupoid, s.h
    turning = jacobian(A * s.u - constraint_shift(s, s.x), s.x)
    parts = [A, turning, mass_matrix(s), jacobian(momentum(s), s.x),
             g.rho(s.x, h) / h, g.L(s.x, s.u, h), g.R(s.x, s.u, h)]  # fmt: skip
    return numeric({"x": s.x, "u": s.u, "q": s.q}, parts, numbers)
