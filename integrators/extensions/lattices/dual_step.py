"""The derivative of a lattice's step on the dual algebroid, applied without forming its matrix.

E(x, w) = (μ, 0) is solved for w, and x′ = x + d(x, w), μ′ = μ + g(x, w); so the derivative M is
the Schur complement of the derivatives of E, d and g, which are sparse sums over sites and bonds. M
is a Poisson map: (Mᵀα)·Π(Mᵀβ) = α·Π′β for all covectors α, β; random pairs test this.

On pairs, ω_i = δx_i ∧ δμ_i of two variations of a run grows by a flux through each bond of site i,
Φ_i = (δx′_i ∧ δF⁺_i − δx_i ∧ δF⁻_i)/h + δs_i ∧ δE_i, with the bond's own F± and, if there are
stages s, E = ∂L_d/∂s. Since d dL_d = 0, Φ_i = −Φ_j: this is the multisymplectic law (Marsden,
Patrick, Shkoller, Comm. Math. Phys. 199 (1998), 351).
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from ...equations import DiscreteEquations, natural_structure
from ...errors import CannotMeasure
from ...geometry import map_text
from ...numbers import (
    Double,
    LazyModule,
    Matrix,
    Number,
    Vector,
    numeric,
    numeric_function,
    sympy,
)
from ...numbers.types import MatrixLike, Rows
from .blocks import at_ends, of_all, placed, places
from .lattice_run import LatticeFlow, LatticeRun

sparse = LazyModule("scipy.sparse")
linalg = LazyModule("scipy.sparse.linalg")
NUMBERS = Double()
#: a `DualStep`, or a `RestrictedStep`, whose file imports this one
PairingStep: TypeAlias = Any
Covector = tuple[np.ndarray, np.ndarray]  # (N, n) and (N, m)


class DualStep:
    """A step of a flow from (x, μ), x (N, n) and μ (N, m), to `after`, and its derivative M.

    All is in double precision, whatever the digits of the flow. Raises `CannotMeasure` for
    compositions, constraints and contact, `StepFailure` if the step is not found.
    """

    def __init__(self, flow: LatticeFlow, x: np.ndarray, mu: np.ndarray, t: float = 0) -> None:
        lattice = flow.lattice
        lattice.refuse("forms of a lattice")
        flow, x, mu = of_one_step(flow, x, mu)
        run = LatticeRun.from_row(flow, x, mu, t)
        self.flow, self.free, self.before = flow, lattice.free, (x, mu)
        w, h = run.stepped(), float(flow.step)
        self.after, (N, S) = (run.x, run.mu), w.shape
        self._parts, self._of_bonds, self._order = derivatives_of_step(flow, x, w, h, t)
        pins = sparse.diags(np.repeat(~self.free, S).astype(float))
        self._factors = linalg.splu((self._parts["Ew"] + pins).tocsc())
        self._h, self._shape = h, (N, x.shape[1], self.before[1].shape[1], S)

    def applied(self, variation: Covector) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Apply M to (δx, δμ): return (δx′, δμ′, δw), shaped (N, n), (N, m) and (N, S)."""
        N, n, m, S = self._shape
        p = self._parts
        dx, dmu = variation[0].ravel(), variation[1].ravel()
        right = np.zeros((N, S))
        right[:, :m] = variation[1]
        dw = self._factors.solve(right.ravel() - p["Ex"] @ dx)
        ends = dx + p["dx"] @ dx + p["dw"] @ dw, dmu + p["gx"] @ dx + p["gw"] @ dw
        return ends[0].reshape(N, n), ends[1].reshape(N, m), dw.reshape(N, S)

    def fluxes(self, one: Covector, other: Covector) -> np.ndarray:
        """Return Φ of each bond at both its ends, (B, 2), for two variations, on pairs.

        Raises `CannotMeasure` on other groupoids, where forms have more terms.
        """
        lattice = self.flow.lattice
        if not lattice.groupoid.canonical:
            raise CannotMeasure(f"{lattice.name}: fluxes are measured on pair(n) alone.")
        pairs, d = lattice.pairs, self._of_bonds
        m, sides = self._shape[2], []
        for variation in (one, other):
            after, _, dw = self.applied(variation)
            x, y, unknowns = (a[pairs] for a in (variation[0], after, dw))  # (B, 2, ·)
            both = x.reshape(len(x), -1), unknowns.reshape(len(x), -1)[:, self._order]
            rows, gain = (
                sum(np.einsum("abk,kb->ka", d[e + by], of)
                    for by, of in zip("xw", both, strict=True))
                for e in "Eg"
            )  # fmt: skip
            by_ends = np.empty_like(rows)
            by_ends[:, self._order] = rows
            rows = by_ends.reshape(unknowns.shape)
            minus = rows[:, :, :m]
            sides.append(((y, minus + gain.reshape(minus.shape)), (x, -minus),
                          (unknowns[:, :, m:], self._h * rows[:, :, m:])))  # fmt: skip
        terms = [
            (a * other_b - other_a * b).sum(axis=2)
            for (a, b), (other_a, other_b) in zip(*sides, strict=True)
        ]
        return np.asarray(sum(terms))

    def transposed(self, alpha: Covector) -> Covector:
        """Return Mᵀα."""
        N, n, m, S = self._shape
        p = self._parts
        a, b = (part.ravel() for part in alpha)
        through = self._factors.solve(p["dw"].T @ a + p["gw"].T @ b, trans="T")
        of_x = a + p["dx"].T @ a + p["gx"].T @ b - p["Ex"].T @ through
        of_mu = b + through.reshape(N, S)[:, :m].ravel()
        keep = self.free[:, None]
        return of_x.reshape(N, n) * keep, of_mu.reshape(N, m) * keep

    def pairing(
        self, random: np.random.Generator, brackets: list[Bracket]
    ) -> list[tuple[float, float]]:
        """Return Π of two random covectors before and after the step, each with absolute terms."""
        after = [tuple(random.normal(size=a.shape) * self.free[:, None] for a in self.before)
                 for _ in range(2)]  # fmt: skip
        before = [self.transposed(covector) for covector in after]
        return [bracket(*ends) for bracket, ends in zip(brackets, (before, after), strict=True)]


def of_one_step(flow: LatticeFlow, x: Rows, mu: Rows) -> tuple[LatticeFlow, np.ndarray, np.ndarray]:
    """Return a flow and a state of it in double precision, in which forms are measured.

    Raises `CannotMeasure` for compositions.
    """
    if flow.scheme.substeps:
        raise CannotMeasure(f"{flow.lattice.name}: {flow.scheme.rule.name} has several substeps; "
                            "ask its base rule.")  # fmt: skip
    if flow.numbers.digits != NUMBERS.digits:
        flow = type(flow)(flow.scheme, flow.step)
    return flow, np.array(x, dtype=float), np.array(mu, dtype=float)


def poisson_defect(step: PairingStep, pairs: int, seed: int, bracket_sign: int = 1) -> float:
    """Return the largest relative difference of a step's pairings over random pairs.

    The difference is (Mᵀα)·Π(Mᵀβ) − α·Π′β for a `DualStep` and ω′(Pa, Pb) − ω(a, b) for a
    `RestrictedStep`, divided by the sum of the absolute values of its terms.
    """
    random = np.random.default_rng(seed)
    brackets = [Bracket(step.flow, x, mu, bracket_sign) for x, mu in (step.before, step.after)]
    worst = 0.0
    for _ in range(pairs):
        (one, scale), (other, more) = step.pairing(random, brackets)
        worst = float(np.maximum(worst, abs(one - other) / (scale + more)))  # np.maximum keeps nan
    return worst


class Bracket:
    """Π at (x, μ): {xⁱ, μ_γ} = ρ̂ⁱ_γ, {μ_γ, μ_ν} = −Ĉ^θ_γν μ_θ at each site."""

    def __init__(self, flow: LatticeFlow, x: np.ndarray, mu: np.ndarray, sign: int) -> None:
        s = flow.scheme.equations.site.s.with_time_as_parameter()
        rho, structure = natural_structure(s, s.x)
        of_mu = sympy.zeros(len(s.mu))
        for theta, c in enumerate(structure):
            of_mu -= sign * c * s.mu[theta]
        f = numeric({"x": s.x, "mu": s.mu}, [rho, of_mu], NUMBERS, columns=True)
        self.rho, self.of_mu = of_all(f, len(x), list(x.T), list(mu.T))

    def __call__(self, one: Covector, other: Covector) -> tuple[float, float]:
        """Return (one · Π other, the sum of the absolute values of its terms)."""
        terms = [np.einsum("ka,abk,kb->kab", one[0], self.rho, other[1]),
                 -np.einsum("kb,abk,ka->kab", one[1], self.rho, other[0]),
                 np.einsum("ka,abk,kb->kab", one[1], self.of_mu, other[1])]  # fmt: skip
        return _totals(terms)

    def form(self, one: Covector, other: Covector) -> tuple[float, float]:
        """Return ω of two vectors (b, δμ), δx = ρ̂ b, and the sum of its terms' absolute values."""
        return _totals([one[0] * other[1], -one[1] * other[0],
                        -np.einsum("ka,abk,kb->kab", one[0], self.of_mu, other[0])])  # fmt: skip


def _totals(terms: list[np.ndarray]) -> tuple[float, float]:
    return sum(float(t.sum()) for t in terms), sum(float(abs(t).sum()) for t in terms)


def derivatives_of_step(
    flow: LatticeFlow, x: np.ndarray, w: np.ndarray, h: float, t: float
) -> tuple[dict[str, MatrixLike], dict[str, np.ndarray], list[int]]:
    """Return ({"Ex": sparse, …}, the same for each bond, the order of a bond's letters).

    These are the derivatives of E, d and g by x (N, n) and w (N, S), summed over sites and bonds;
    those of fixed sites are 0.
    """
    scheme, (N, S), lattice = flow.scheme, w.shape, flow.lattice
    pairs, n, m = lattice.pairs, x.shape[1], scheme.equations.groupoid.dim_u
    # a bond's letters: x of both ends; u of both ends, then each stage of both
    order = [c + end * S + i for c in range(0, S, m) for end in (0, 1) for i in range(m)]
    both = np.concatenate([w[pairs[:, 0]], w[pairs[:, 1]]], axis=1)[:, order]
    at = ((scheme.equations.site, w, None), (scheme.equations.bond, both, order))
    sizes = {"E": S, "g": m, "d": n, "x": n, "w": S}
    parts = {name: sparse.csr_matrix((N * sizes[name[0]], N * sizes[name[1]]))
             for name in ("Ex", "Ew", "gx", "gw", "dx", "dw")}  # fmt: skip
    for (_, p, ends), (equations, unknowns, own) in zip(scheme.terms_at(t), at, strict=True):
        matrices = of_bonds = _derivatives(equations, at_ends(ends, x)[0], unknowns, p, h)
        for name, blocks in matrices.items():
            if name[0] == "d" and own is order:
                continue  # the terms of the sites already move x of both ends
            i, j = (places(ends, sizes[k], own if k in "Ew" else None) for k in name)
            parts[name] += placed(blocks, i, j, parts[name].shape)
    free = {k: sparse.diags(np.repeat(lattice.free, size).astype(float))
            for k, size in sizes.items()}  # fmt: skip
    parts = {name: free[name[0]] @ p @ free[name[1]] for name, p in parts.items()}
    return parts, of_bonds, order


def _derivatives(
    equations: DiscreteEquations, x: list[Vector], w: Matrix, p: list[Number], h: float
) -> dict[str, np.ndarray]:
    """Return {"Ex": (rows, columns, r), …} of one term at r places; E is in the order of its w."""
    s, (n, m) = equations.s, (equations.s.n, len(equations.u))
    digits = [float(of(20)) for of in s.constants.values()]
    time = p[len(s.parameter_list) :]  # behind the parameters, as in `LatticeScheme.terms_at`
    q = [h, *p[: len(s.parameter_list)], *digits]
    f = numeric_function(map_text(equations, "one_step"), NUMBERS, columns=True)
    _, Ew, Ez, _, by_w, by_z = of_all(f, len(w), [*x, *time], [0.0] * m, list(w.T), q)
    return {"Ex": Ez[:, :n], "Ew": Ew, "gx": by_z[len(s.x) :, :n], "gw": by_w[len(s.x) :],
            "dx": by_z[:n, :n], "dw": by_w[:n]}  # fmt: skip
