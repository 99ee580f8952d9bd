"""Holonomic constraints on bonds: their rows of a step, and the projection of a row's momenta.

A bond (i, j) has k rows φ(x_i, x_j) = 0. Its multipliers are unknowns of site j after u_j, and its
rows are equations of site j: so a constrained chain is block-tridiagonal like any other, and
elimination in the order (u_j, λ_j) meets the masses first and then A M⁻¹ Aᵀ of the links so far,
which are regular. Letters with the values 0 or 1 keep at 0 the u of fixed sites and unused
multipliers.

    F⁻(x, u)/h = μ + Σ A(x)ᵀλ,    φ(b(x, u)) = 0,    μ ← μ + (F⁺ − F⁻)/h + Σ A(x)ᵀλ

is a step (`ConstrainedEquations`) without the impulses Aᵀν at its end: the next λ acts along them
too, so they change no x. A row of a run is projected: ∂l/∂ξ(x, v) = μ + Σ A(x)ᵀν with A(x) v = 0.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from ...compiler import Step, kinds_of
from ...equations import (
    ConstrainedEquations,
    DiscreteEquations,
    SceneSymbols,
    constraint,
    constraint_matrix,
    times,
    vector,
)
from ...errors import BadInput
from ...numbers import Double, LazyModule, Node, NodeMatrix, Scope, jacobian, numeric, sympy
from ...numbers.types import Function, Letter, Number
from .blocks import at_ends, of_all, placed, places
from .lattice import Lattice

sparse = LazyModule("scipy.sparse")
linalg = LazyModule("scipy.sparse.linalg")

#: round-offs of the largest entry to which a start is known: 4 as for a scene
#: (`constrained_start`), and 16 of x that Newton's method leaves in a row of a run
#: (`compiler.UNSEEN`)
UNITS = 20
#: a row of A of length 1 counts as dependent if its squared distance from the others is smaller:
#: this is far below 1/N, the value for N links between two fixed ends, and far above round-off
DEPENDENT = 2.0**-40


class BondConstraints:
    """The rows and multipliers of a lattice's bonds, from the symbols of one site and of one bond.

    bond: the discrete equations of a bond without them; count: k, the rows of a bond. Raises
    `CannotMeasure` for a rule with stages, or one that evaluates L off the straight step.
    """

    def __init__(self, site: DiscreteEquations, bond: DiscreteEquations) -> None:
        self.site, self.s = site, bond.s
        self.of_step = ConstrainedEquations(bond.s, bond.rule, bond)
        self.matrix = constraint_matrix(bond.s, bond.s.x)
        self.count, self.m = self.matrix.rows, len(site.u)
        self.kinds = kinds_of(
            ("velocity", bond.s.u[: self.m]), ("multiplier", self.of_step.multipliers)
        )
        #: letters that are 1 if a site moves, and if a bond's constraint is active
        self.own = _letters("fr0", "bo0")
        self.bond_own = _letters("fr0", "fr1", "bo0")

    def step(self) -> tuple[Step, Step]:
        """Return a step's equations of a site and of a bond, ordered by ends."""
        s, of, graph = self.s, self.of_step, self.of_step.graph
        size = 2 * self.m + self.count
        none = {e.index: graph.number(0) for e in graph.letters([*s.mu, *of.w[size:]])}
        rows, gain = (graph.rebuilt(part, none)
                      for part in (of.rows[:size], of.increment[len(s.x) :]))  # fmt: skip
        slope = of.scope.jacobian(rows, graph.letters(of.w[:size]))
        return self._of_site(self.site.step), self._of_bond(of.free.step, rows, slope, gain)

    def projection(self) -> tuple[Step, Step]:
        """Return the equations of v and ν of a site and of a bond, solved against μ; x stays."""
        still = ((e.step, e.graph.number(0)) for e in (self.site, self.of_step.free))
        site, bond = (replace(e, increment=[zero] * len(e.x), gain=[zero] * len(e.u))
                      for e, zero in still)  # fmt: skip
        graph, u, scope = site.graph, site.graph.letters(site.u), Scope(site.graph)
        (momentum,) = scope.jacobian([graph.read(self.site.s.lagrangian)], u)
        site = self._of_site(replace(site, rows=momentum, slope=scope.jacobian(momentum, u)))
        graph, u, scope = bond.graph, bond.graph.letters(bond.u), Scope(bond.graph)
        la, A = graph.letters(self.of_step.multipliers), graph.matrix(self.matrix)
        rows = [*(-e for e in graph.transposed(A, la)), *graph.times(A, u)]
        return site, self._of_bond(bond, rows, scope.jacobian(rows, [*u, *la]), bond.gain)

    def _of_site(self, step: Step) -> Step:
        """Return a site's step with multipliers after u, which its equations do not contain."""
        m, k, graph = self.m, self.count, step.graph
        more = vector("la", k)
        free, bound = graph.letters(self.own)
        at_rest, unused = graph.one - free, graph.one - bound
        zero = [graph.number(0)] * (m + k)
        slope = [[*(e * free for e in row), *zero[m:]] for row in step.slope]
        slope += [[*zero] for _ in range(k)]
        for i, own in enumerate([at_rest] * m + [unused] * k):
            slope[i][i] = slope[i][i] + own
        u = graph.letters(step.u)
        rows = [e * free + own * at_rest for e, own in zip(step.rows, u, strict=True)]
        return replace(
            step, w=(*step.u, *more), kinds=self.kinds, slope=slope, wanted=(),
            rows=[*rows, *(e * unused for e in graph.letters(more))],
            gain=[e * free for e in step.gain],
        )  # fmt: skip

    def _of_bond(self, step: Step, rows: list[Node], slope: NodeMatrix, gain: list[Node]) -> Step:
        """Return a bond's step for rows of (u_i, u_j, λ); i's multipliers' places are unused."""
        m, k, graph = self.m, self.count, step.graph
        free_i, free_j, bound = graph.letters(self.bond_own)
        kept = [*[free_i] * m, *[free_j] * m, *[bound] * k]
        # the places of (u_i, u_j, λ) among the unknowns of both ends
        at, size = [*range(m), *range(m + k, 2 * (m + k))], 2 * (m + k)
        by_ends = [graph.number(0)] * size
        by_both = [list(by_ends) for _ in by_ends]
        for i, (row, keep) in enumerate(zip(at, kept, strict=True)):
            by_ends[row] = keep * rows[i]
            for j, column in enumerate(at):
                by_both[row][column] = keep * slope[i][j]
        w = (*step.u[:m], *vector("nu", k), *step.u[m:], *self.of_step.multipliers)
        gains = [keep * e for keep, e in zip(kept, gain)]  # noqa: B905
        return replace(step, w=w, rows=by_ends, kinds=2 * self.kinds, slope=by_both, gain=gains,
                       wanted=())  # fmt: skip


def _letters(*names: str) -> tuple[Letter, ...]:
    """Return letters that no parameter can have (`symbols._TAKEN`)."""
    return tuple(sympy.Symbol(name, real=True) for name in names)


def check_constraints(
    lattice: Lattice, s: SceneSymbols, p: list[Number], x: np.ndarray, v: np.ndarray,
    eps: float,
) -> None:  # fmt: skip
    """Raise `BadInput` unless x (N, n) and v (N, m) satisfy independent constraints on the bonds.

    p: the parameters at the bonds, numbers or (B,). A row f may be off by UNITS·eps of its
    size, Σ |∂f/∂zᵢ| max |z| plus its absolute terms, where z is x and v of both ends.
    """
    pairs, free, N, m = lattice.pairs, lattice.free, lattice.sites, v.shape[1]
    (k, f), n = _of_start(s), len(s.x)
    base, velocity = at_ends(pairs, x, v)
    off, by, size, A = of_all(f, len(pairs), base, velocity, 1.0, p)
    size = size[:, 0] + abs(by[:, :n]).sum(axis=1) * abs(np.array(base)).max(axis=0)
    size = size + abs(by[:, n:]).sum(axis=1) * abs(np.array(velocity)).max(axis=0)
    active = free[pairs].any(axis=1)
    for row, bond in zip(*np.nonzero(~(abs(off[:, 0]) <= UNITS * eps * size)), strict=True):
        what, start = ("φ", "x0") if row < k else ("A v", "v0")
        raise BadInput(
            f"{lattice.name}: {what} of the constraint of bond {bond}, between the sites "
            f"{pairs[bond][0]} and {pairs[bond][1]}, is {off[row, 0, bond]:.3g} at the start, and "
            f"must be 0; change {start}."
        )
    A = np.moveaxis(A, 2, 0) * np.repeat(free[pairs], m, axis=1)[:, None]  # (B, k, 2m)
    length = np.sqrt((A**2).sum(axis=2, keepdims=True))
    for bond in np.flatnonzero(active & (length == 0).any(axis=(1, 2))):
        raise BadInput(f"{lattice.name}: a row of the constraint of bond {bond} restricts no "
                       "velocity at x0; leave it out, or begin elsewhere.")  # fmt: skip
    dependent = _dependent((A / np.where(length == 0, 1, length))[active], pairs[active], N)
    if dependent is not None:
        bond = np.flatnonzero(active)[dependent]
        raise BadInput(f"{lattice.name}: the constraints are redundant: at x0 a row of bond {bond} "
                       "follows from other rows; leave one out.")  # fmt: skip


@lru_cache(maxsize=8)
def _of_start(s: SceneSymbols) -> tuple[int, Function]:
    """Return (rows of a bond, a function).

    The function gives (φ, A u), the slope of these by x and u, the sums of absolute terms, and A.
    """
    matrix = constraint_matrix(s, s.x)
    rows = constraint(s, s.x).col_join(times(matrix, s.u))
    slope = jacobian(rows, s.x.col_join(s.u))
    terms = rows.applyfunc(
        lambda e: sympy.Add(*[sympy.Abs(t, evaluate=False) for t in sympy.Add.make_args(e)])
    )
    arguments = {"x": s.x, "u": s.u, "h": s.h, "p": s.parameter_list}
    return matrix.rows, numeric(arguments, [rows, slope, terms, matrix], Double(), columns=True)


def _dependent(A: np.ndarray, pairs: np.ndarray, N: int) -> int | None:
    """Return a bond with a row that depends on others, or None; rows A (B, k, 2m) have length 1."""
    B, k, m = *A.shape[:2], A.shape[2] // 2
    rows = np.arange(B * k).reshape(B, k)
    of_rows = placed(np.moveaxis(A, 0, 2), rows, places(pairs, m), (B * k, N * m))
    # the shift keeps pivots from being 0, whose inverse would be infinite
    left = (of_rows @ of_rows.T + DEPENDENT / 2**10 * sparse.identity(B * k)).tocsc()
    factors = linalg.splu(left, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0,
                          options={"SymmetricMode": True})  # fmt: skip
    pivots = abs(factors.U.diagonal())
    least = int(np.argmin(pivots))
    if pivots[least] > DEPENDENT:
        return None
    return int(np.flatnonzero(factors.perm_c == least)[0]) // k
