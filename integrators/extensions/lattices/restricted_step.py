"""The derivative of a step with constraints on bonds, on the vectors that these admit.

The constraints admit a vector (b, δμ), δx = ρ̂ b, at a state that satisfies them if A b = 0 and d(A
ξ) = 0. On such vectors the step preserves

    ω((b, δ), (b′, δ′)) = b·δ′ − b′·δ + μ_θ Ĉ^θ_{γν} b^γ b′^ν

(Marsden, West 2001, 3.5.3; for scenes `restricted_defect`). Random pairs of such vectors are
taken through the step. Each needs two sparse solutions, of the step's equations in (u, λ) and of
those of (v, ν) that project the momentum at its end; b′ follows from h δu + R b = L b′.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from ...equations import SceneSymbols, constraint, constraint_matrix, mass_matrix, momentum, vector
from ...numbers import Double, LazyModule, Matrix, Vector, jacobian, numeric
from ...numbers.types import Function, MatrixLike
from .blocks import at_ends, of_all, of_lattice, placed, places
from .dual_step import Bracket, Covector, DualStep, derivatives_of_step, of_one_step
from .lattice_run import LatticeFlow, LatticeRun, LatticeScheme

sparse = LazyModule("scipy.sparse")
linalg = LazyModule("scipy.sparse.linalg")
NUMBERS = Double()


class RestrictedStep:
    """A step of a flow with constraints from (x, μ), x (N, n) and μ (N, m), a row of a run.

    Raises `CannotMeasure` for compositions, `StepFailure` if the step is not found.
    """

    def __init__(self, flow: LatticeFlow, x: np.ndarray, mu: np.ndarray, t: float = 0) -> None:
        flow, x, mu = of_one_step(flow, x, mu)
        self.flow, self.h, self.before = flow, float(flow.step), (x, mu)
        (self.N, self.m), self.pairs = mu.shape, flow.lattice.pairs
        self.free = flow.lattice.free[:, None]
        run = LatticeRun.from_row(flow, x, mu, t)
        start = Linearised(flow.scheme, x, *run.projected, t)
        w = run.stepped()
        self.after = run.x, run.mu
        self.start, self.end = start, Linearised(flow.scheme, run.x, *run.projected, run.t)
        u, multipliers = w[:, : self.m], w[self.pairs[:, 1], self.m :]
        self._along, _, _ = derivatives_of_step(flow, x, u, self.h, t)
        #: ∂(A(x)ᵀλ)/∂x, with the λ that leaves the start
        self._turned = start.turned(multipliers)
        of_arrow = _of_arrow(flow.scheme.equations.site.s)
        self.L, self.R = of_all(of_arrow, self.N, list(x.T), list(u.T), self.h)
        p, left = self._along, start.A.T
        moved = self.end.slope @ p["dw"]
        self._solve = start.with_rows(p["Ew"], -left, moved)

    def tangent(self, random: np.random.Generator) -> Covector:
        """Return a random vector (b, δμ) that the constraints admit, (N, m) each."""
        b, force = (random.normal(size=(self.N, self.m)) * self.free for _ in range(2))
        none = np.zeros(self.start.A.shape[0])
        one = sparse.identity(b.size)
        b = self.start.with_rows(one, self.start.A.T, self.start.A)(b.ravel(), none)[: b.size]
        return b.reshape(self.N, self.m), self.start.momentum_change(self.start.rho @ b, force)

    def applied(self, vector: Covector) -> Covector:
        """Return the vector (b′, δμ′) at the end of the step."""
        b, dmu = vector[0].ravel(), vector[1].ravel()
        p, start, end = self._along, self.start, self.end
        dx = start.rho @ b
        missing = dmu - p["Ex"] @ dx + self._turned @ dx
        solution = self._solve(missing, -end.slope @ (dx + p["dx"] @ dx))
        du, dlambda = solution[: b.size], solution[b.size :]
        after = dx + p["dx"] @ dx + p["dw"] @ du
        pushed = dmu + p["gx"] @ dx + p["gw"] @ du + start.A.T @ dlambda + self._turned @ dx
        pushed = pushed + end.turned(end.impulses) @ after - end.moved @ after
        arrow = self.h * du.reshape(-1, self.m) + np.einsum("abi,ib->ia", self.R, vector[0])
        target = np.linalg.solve(np.moveaxis(self.L, 2, 0), arrow[:, :, None])[:, :, 0]
        return target * self.free, end.momentum_change(after, pushed)

    def pairing(
        self, random: np.random.Generator, brackets: list[Bracket]
    ) -> list[tuple[float, float]]:
        """Return ω of two random vectors before and after the step, each with absolute terms."""
        before = [self.tangent(random) for _ in range(2)]
        after = [self.applied(vector) for vector in before]
        return [
            bracket.form(*ends) for bracket, ends in zip(brackets, (before, after), strict=True)
        ]


def step_derivative(
    flow: LatticeFlow, x: np.ndarray, mu: np.ndarray, t: float = 0
) -> DualStep | RestrictedStep:
    """Return the step from (x, μ) with its derivative, of the kind that the lattice has."""
    return (RestrictedStep if flow.scheme.constraints else DualStep)(flow, x, mu, t)


class Linearised:
    """Constraints and momenta, linearised at x (N, n) with velocities (N, m), impulses (B, k).

    A (Bk, Nm) of A b = 0, slope φ′ and turning ∂(Aξ)/∂x (Bk, Nn), moved ∂p/∂x (Nm, Nn) and mass
    ∂p/∂ξ (Nm, Nm) of p = ∂l/∂ξ, rho (Nn, Nm). Columns of fixed sites are 0.
    """

    def __init__(
        self, scheme: LatticeScheme, x: Matrix, v: Matrix, impulses: Matrix | None = None,
        t: float = 0,
    ) -> None:  # fmt: skip
        lattice, (self.N, self.m) = scheme.lattice, v.shape
        self.scheme, self.x, self.n = scheme, x, x.shape[1]
        self.pairs, free, k = lattice.pairs, lattice.free, scheme.equations.constraints.count
        self.impulses = np.zeros((len(self.pairs), k)) if impulses is None else impulses
        self.held = np.repeat(~free, self.m)
        #: rows of bonds between two fixed sites restrict nothing
        self.idle = np.repeat(~free[self.pairs].any(axis=1), k)
        s, p, sites = scheme.terms_at(t)[0]
        matrices = of_all(_of_site(s), self.N, *at_ends(sites, x, v), 1.0, p)
        self.mass, self.moved, self.rho = (of_lattice(e, sites, self.N) for e in matrices)
        self._moving = {k: sparse.diags(np.repeat(free, size).astype(float))
                        for k, size in (("g", self.m), ("x", self.n))}  # fmt: skip
        self.rho = self._moving["x"] @ self.rho @ self._moving["g"]
        A, slope, turning = self._of_bonds(v, 0 * self.impulses)[:3]
        self.A = self._rows(A, self.m) @ self._moving["g"]
        self.slope, self.turning = (self._rows(e, self.n) @ self._moving["x"]
                                    for e in (slope, turning))  # fmt: skip

    def _of_bonds(self, v: np.ndarray, impulses: np.ndarray) -> list[np.ndarray]:
        s, p, pairs = self.scheme.terms[1]
        arguments = *at_ends(pairs, self.x, v), list(impulses.T)
        return of_all(_of_bond(s), len(pairs), *arguments, 1.0, p)

    def _rows(self, blocks: np.ndarray, size: int) -> MatrixLike:
        """Return blocks (k, 2·size, B) of bonds as a matrix (Bk, N·size)."""
        k, _, B = blocks.shape
        rows = np.arange(B * k).reshape(B, k)
        return placed(blocks, rows, places(self.pairs, size), (B * k, self.N * size))

    def turned(self, multipliers: np.ndarray) -> MatrixLike:
        """Return ∂(Aᵀλ)/∂x, (Nm, Nn), for the multipliers of the bonds (B, k)."""
        blocks = self._of_bonds(np.zeros((self.N, self.m)), multipliers)[3]
        matrix = of_lattice(blocks, self.pairs, self.N)
        return self._moving["g"] @ matrix @ self._moving["x"]

    def with_rows(
        self, own: MatrixLike, left: MatrixLike, rows: MatrixLike
    ) -> Callable[[Vector, Vector], Vector]:
        """Return a solver (r, s) ↦ (a, l) of own a + left l = r, rows a = s; a = 0 at fixed
        sites."""
        free = self._moving["g"]
        own = free @ own @ free + sparse.diags(self.held.astype(float))
        idle = sparse.diags(self.idle.astype(float))
        factors = linalg.splu(sparse.bmat([[own, left], [rows, idle]], format="csc"))

        def solve(r: np.ndarray, s: np.ndarray) -> np.ndarray:
            right = np.concatenate([np.where(self.held, 0, r), np.where(self.idle, 0, s)])
            return np.asarray(factors.solve(right))

        return solve

    def momentum_change(self, dx: np.ndarray, force: np.ndarray) -> np.ndarray:
        """Return δμ (N, m) of a state that moves by dx, is pushed, and keeps d(Aξ) = 0."""
        solve = self.with_rows(self.mass, -self.A.T, self.A)
        dv = solve(force.ravel(), -self.turning @ dx)[: self.N * self.m]
        change = self._moving["g"] @ (self.moved @ dx) + self.mass @ dv
        return np.asarray(change).reshape(self.N, self.m)


@lru_cache(maxsize=32)
def _of_site(s: SceneSymbols) -> Function:
    """Return a compiled function of (x, ξ): ∂p/∂ξ, ∂p/∂x and ρ̂."""
    parts = [mass_matrix(s), jacobian(momentum(s), s.x), s.groupoid.rho(s.x, s.h) / s.h]
    arguments = {"x": s.x, "u": s.u, "h": s.h, "p": s.parameter_list}
    return numeric(arguments, parts, NUMBERS, columns=True)


@lru_cache(maxsize=32)
def _of_bond(s: SceneSymbols) -> Function:
    """Return a compiled function of (x, ξ, λ): A, φ′, ∂(Aξ)/∂x and ∂(Aᵀλ)/∂x."""
    A = constraint_matrix(s, s.x)
    multipliers = vector("la", A.rows)
    parts = [A, jacobian(constraint(s, s.x), s.x), jacobian(A * s.u, s.x),
             jacobian(A.T * multipliers, s.x)]  # fmt: skip
    arguments = {"x": s.x, "u": s.u, "la": multipliers, "h": s.h, "p": s.parameter_list}
    return numeric(arguments, parts, NUMBERS, columns=True)


@lru_cache(maxsize=32)
def _of_arrow(s: SceneSymbols) -> Function:
    """Return a compiled function of an arrow: L and R."""
    g, (x, u, h) = s.groupoid, (s.x, s.u, s.h)
    return numeric({"x": x, "u": u, "h": h}, [g.L(x, u, h), g.R(x, u, h)], NUMBERS, columns=True)
