"""The gaps φ ≥ 0 of all sites and bonds of a lattice: `contact.Gaps` with sparse matrices.

Vectors of x, ξ, μ hold site after site, vectors of φ the gaps of site after site, then of bond
after bond; x has the time behind it if a term depends on the time. If bonds have no velocities,
each site has its own mass matrix: an impulse at a site changes the velocity of another one only
through the bonds within a step. The iteration solves for P ≥ 0 with U₀ + W P ≥ 0, U₀ = φ/h − W P.
It reduces that error by the factor (hω)²/(4 + (hω)²) (midpoint rule, ω the fastest motion), or
removes it at once if forces are taken at the ends of the step: the number of free steps in a step
does not grow with the sites. W couples gaps that share a site; each connected component of gaps is
solved by itself, as in a scene (Moreau's law of simultaneous impacts). In more than 16 digits, of
which scipy has no sparse matrices, they are dense.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ...equations import SceneSymbols, legendre_inverse
from ...errors import BadInput, CannotMeasure
from ...numbers import LazyModule, Number, finite, numeric
from ...numbers.types import Function, MatrixLike, Vector
from ..contact import (
    BESIDE,
    TOUCHING,
    Cones,
    Gaps,
    NotFound,
    Place,
    gap_functions,
    motion_functions,
    opposed,
    scaling,
)
from .blocks import at_ends, places

if TYPE_CHECKING:
    from .lattice_flow import LatticeFlow

sparse = LazyModule("scipy.sparse")
graphs = LazyModule("scipy.sparse.csgraph")


@dataclass(frozen=True, eq=False)
class GapTerm:
    """The gaps of every site, or of every bond: K functions of x at its ends.

    word: "site" or "bond"; ends (E, 1 or 2): the sites; which: the numbers of the sites or bonds
    that move; p: parameters, numbers or (E,); place, values: functions of `contact.gap_functions`;
    m: velocities of a site.
    """

    flow: LatticeFlow
    word: str
    ends: np.ndarray
    which: np.ndarray
    p: list[Number | Vector]
    K: int
    place: Function
    values: Function
    m: int

    @cached_property
    def _own_p(self) -> list[Number]:
        return [e[self.which] if np.ndim(e) else e for e in self.p]

    def phi(self, rows: np.ndarray) -> np.ndarray:
        """Return φ of all, (r, E, K), at rows of x (r, N, n)."""
        p = [np.tile(e, len(rows)) if np.ndim(e) else e for e in self.p]
        wide = self.ends.shape[1] * rows.shape[2]
        at = rows[:, self.ends].reshape(len(rows) * len(self.ends), wide)
        gaps = _each(self.flow, self.values(list(at.T), p), (self.K,), len(at))
        return gaps.reshape(len(rows), len(self.ends), self.K)

    def at(self, x: np.ndarray) -> list[np.ndarray]:
        """Return φ, the size that determines its round-off, φ′ and the normal row of each gap.

        At the centre of a distance, where its slope is 0/0, a point beside it is taken, as in
        `Gaps`.
        """
        rows = x[self.ends[self.which]].reshape(len(self.which), -1)

        def found(at: np.ndarray) -> list[np.ndarray]:
            with np.errstate(all="ignore"):
                values = self.place(list(at.T), self._own_p)
            wide = self.m * self.ends.shape[1]
            shapes = (self.K,), (self.K,), (self.K, at.shape[1]), (self.K, wide)
            return [_each(self.flow, e, shape, len(at))
                    for e, shape in zip(values, shapes, strict=False)]  # fmt: skip

        parts = found(rows)
        for power in BESIDE:
            lost = ~finite(parts[2]).all(axis=(1, 2))
            if not lost.any():
                break
            beside = found(rows + (4 * self.flow.numbers.eps) ** (power / 2) * (1 + abs(rows)))
            parts[1:] = [np.where(lost.reshape(-1, *[1] * (e.ndim - 1)), b, e)
                         for e, b in zip(parts[1:], beside[1:], strict=True)]  # fmt: skip
        return parts


class LatticeGaps(Gaps):
    """The gaps of the moving sites of a lattice, and of the bonds that have a moving end.

    They have no friction. Raises `BadInput` for gaps that are not expressions of x and p, or that
    have coordinates of a plane, `CannotMeasure` for a site's Lagrangian that is not quadratic in
    the velocity.
    """

    def __init__(self, flow: LatticeFlow) -> None:
        self.flow, self.lattice, self.numbers = flow, flow.lattice, flow.numbers
        self._still = terms = self._terms(self.numbers.number(0))
        name, s = flow.lattice.name, terms[0][0]
        if not legendre_inverse(s, self.numbers).quadratic:
            raise CannotMeasure(f"{name}: contact on a lattice needs a kinetic energy that is "
                                "quadratic in the velocity.")  # fmt: skip
        self._motion, self._energy = motion_functions(s, self.numbers, columns=True)
        self.quadratic, self.rough, self.friction, self.coordinates = True, False, [], []
        (self.N, self.n), self.m = self.lattice.start[0].shape, len(s.u)
        contacts = flow.scheme.equations.contacts
        self.terms = [self._term(s, contact, word, p, ends) for (s, p, ends), contact, word in
                      zip(terms, contacts, ("site", "bond"), strict=True)
                      if contact is not None]  # fmt: skip
        self.count = sum(len(term.which) * term.K for term in self.terms)
        self._last: tuple[np.ndarray | None, Any] = None, None

    def _terms(self, t: Number) -> list[tuple[SceneSymbols, list[Number], np.ndarray]]:
        """Return the terms of the sites and of the bonds, with parameters as the flow's numbers."""
        terms = self.flow.scheme.terms_at(t, self.numbers.number)
        return [(s, [self.flow.exact(e)[()] for e in p], ends) for s, p, ends in terms]

    def _term(
        self, s: SceneSymbols, contact: Function, word: str, p: list[Number], ends: np.ndarray
    ) -> GapTerm:
        coordinates, place, values = gap_functions(s, contact, self.numbers, columns=True)
        if any(e is not None for e in coordinates):
            raise BadInput(f"{self.lattice.name}: the contact of a lattice has no friction; give "
                           "gaps φ alone, without the coordinates of a plane.")  # fmt: skip
        which = np.flatnonzero(self.lattice.free[ends].any(axis=1))
        return GapTerm(self.flow, word, ends, which, p, len(coordinates), place, values, self.m)

    @cached_property
    def owners(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The site or −1, the bond or −1, and the number among its gaps, of each gap, (gaps,)."""
        parts = []
        for term in self.terms:
            own = np.repeat(term.which, term.K)
            sites, bonds = (own if term.word == word else 0 * own - 1 for word in ("site", "bond"))
            parts.append((sites, bonds, np.tile(np.arange(term.K), len(term.which))))
        sites, bonds, numbers = map(np.concatenate, zip(*parts, strict=True))
        return sites, bonds, numbers

    def where(self, k: int) -> tuple[str, int, int]:
        """Return "site" or "bond", its number, and the number among its gaps of gap k of all."""
        site, bond, number = (int(e[k]) for e in self.owners)
        return ("site", site, number) if bond < 0 else ("bond", bond, number)

    def phi(self, rows: np.ndarray) -> np.ndarray:
        """Return φ of the gaps that move, (r, gaps), at rows of x (r, N, n)."""
        return np.hstack([term.phi(rows)[:, term.which].reshape(len(rows), -1)
                          for term in self.terms])  # fmt: skip

    def by_terms(self, values: np.ndarray) -> dict[str, np.ndarray]:
        """Return values of the gaps that move, (r, gaps), as {"site": (r, N, K), "bond": (r, B,
        K)}.

        Other gaps have 0; a kind that the lattice lacks is left out.
        """
        tables, first = {}, 0
        for term in self.terms:
            last = first + len(term.which) * term.K
            table = self.numbers.zeros(len(values), len(term.ends), term.K)
            shape = len(values), len(term.which), term.K
            table[:, term.which] = values[:, first:last].reshape(shape)
            tables[term.word], first = table, last
        return tables

    def listed(self, **tables: np.ndarray) -> np.ndarray:
        """Return values of the gaps that move, (r, gaps), from the tables of `by_terms`."""
        return np.hstack([tables[term.word][:, term.which].reshape(len(tables[term.word]), -1)
                          for term in self.terms])  # fmt: skip

    def _terms_at(self, x: np.ndarray) -> list[tuple[SceneSymbols, list[Number], np.ndarray]]:
        """Return the terms at the time of a vector x, if some depend on it."""
        return self._terms(x[self.N * self.n]) if len(x) > self.N * self.n else self._still

    def of_sites(self, x: np.ndarray) -> np.ndarray:
        """Return a vector x by sites, (N, n)."""
        return x[: self.N * self.n].reshape(self.N, self.n)

    def at(self, x: np.ndarray, reach: np.ndarray | float = 0) -> Place:
        """Return the gaps at x.

        `own` includes the round-off that Newton's method leaves, which is that of its whole
        solution, not of each site.
        """
        parts, rows = [], self.of_sites(x)
        for term in self.terms:
            phi, own, slope, normal = term.at(rows)
            ends = term.ends[term.which]
            free = np.repeat(self.lattice.free[ends], self.m, axis=1)
            across = np.repeat(places(ends, self.m), term.K, axis=0)
            of_all = self._matrix((normal * free[:, None]).reshape(across.shape), across)
            parts.append((phi.ravel(), own.ravel(), abs(slope).sum(axis=2).ravel(), of_all))
        *columns, normals = zip(*parts, strict=True)
        phi, own, steep = map(np.concatenate, columns)
        size = own + reach
        closed = abs(phi) <= TOUCHING * self.numbers.eps * size
        known = own + steep * abs(rows).max()
        stacked = np.vstack if isinstance(normals[0], np.ndarray) else sparse.vstack
        of_all = normals[0] if len(normals) == 1 else stacked(normals)
        return Place(x, phi, known, size, of_all, [], [], [], steep, closed)

    def _matrix(self, values: np.ndarray, columns: np.ndarray) -> MatrixLike:
        """Return a matrix (r, N m) that has the values (r, w) in the columns (r, w).

        A site that is fixed joins no gaps: zeros are no entries of a sparse matrix.
        """
        if self.numbers.dtype is object:
            dense = self.numbers.zeros(len(values), self.N * self.m)
            np.put_along_axis(dense, columns, values, axis=1)
            return dense
        ends = np.arange(0, values.size + 1, values.shape[1])
        matrix = sparse.csr_matrix((values.flatten(), columns.ravel(), ends),
                                   (len(values), self.N * self.m))  # fmt: skip
        matrix.eliminate_zeros()
        return matrix

    def at_start(self, x: np.ndarray) -> Place:
        largest = max(abs(self.of_sites(x)).max(), abs(self.lattice.start[0]).max())
        return self.at(x, self.at(x).scale * largest)

    def check(self, x: np.ndarray) -> None:
        """Raise `BadInput` unless x (N, n) is outside the obstacle, with room to move."""
        place, name = self.at_start(x.ravel()), self.lattice.name
        for k in np.flatnonzero(~(place.phi >= -TOUCHING * self.numbers.eps * place.size))[:1]:
            word, i, own = self.where(k)
            raise BadInput(f"{name}: x0 of {word} {i} is inside the obstacle: its gap {own} is "
                           f"{place.phi[k]:.3g}; begin outside.")  # fmt: skip
        closed = np.flatnonzero(place.closed)
        normals = place.normal[closed]
        for k in closed[~(abs(normals).max(axis=1).toarray().ravel() > 0)]:
            word, i, own = self.where(k)
            raise BadInput(f"{name}: gap {own} of {word} {i} is closed at x0 and no motion changes "
                           "it there; write it with a slope (a distance has one).")  # fmt: skip
        for some in _components(normals @ normals.T):
            rows = normals[some]
            if opposed(rows[:, np.unique(rows.indices)].toarray()):
                word, i, _ = self.where(int(closed[some[0]]))
                raise BadInput(f"{name}: closed gaps of {word} {i} contradict each other "
                               "at x0: they leave no direction to move in; fix the site."
                               )  # fmt: skip

    def velocity(self, x: np.ndarray, mu: np.ndarray, near: np.ndarray | None = None) -> np.ndarray:
        """Return ξ(x, μ); it is 0 at fixed sites."""
        _, back, still = self._of_mass(x)
        velocity = np.einsum("iab,ib->ia", back, mu.reshape(self.N, self.m) - still)
        return np.asarray(velocity * self.lattice.free[:, None]).ravel()

    def _of_mass(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return ∂μ/∂ξ, ∂ξ/∂μ (N, m, m) and ∂l/∂ξ at rest (N, m) by site; one x is kept."""
        if x is not self._last[0]:
            p = self._terms_at(x)[0][1]
            rest = [self.numbers.number(0)] * self.m
            mass, still = self._motion(list(self.of_sites(x).T), rest, p)
            mass = self.flow.exact(mass).reshape(self.m, self.m, -1)
            one, solve = self.numbers.identity(self.m), self.numbers.solve
            # a single matrix, if all sites have the same
            in_python = self.numbers.dtype is object
            back = np.array([solve(e, one) for e in mass.T]) if in_python else solve(mass.T, one)
            mass, back = (np.broadcast_to(e, (self.N, *one.shape)) for e in (mass.T, back))
            self._last = x, (mass, back, _each(self.flow, still, (self.m,), self.N))
        return self._last[1]

    def _freed(self, x: np.ndarray, rows: MatrixLike) -> MatrixLike:
        """Return rows · ∂ξ/∂μ."""
        (_, back, _), k = self._of_mass(x), self.m
        if isinstance(rows, np.ndarray):
            by_sites = rows.reshape(len(rows), self.N, 1, k)
            return np.matmul(by_sites, back).reshape(rows.shape)
        own = np.repeat(np.arange(self.N * k).reshape(self.N, k), k, axis=0)
        return rows @ self._matrix(back.reshape(-1, k), own)

    def flexibility(
        self, x: np.ndarray, xi: np.ndarray, rows: MatrixLike, push: MatrixLike
    ) -> MatrixLike:
        """Return rows M⁻¹ pushᵀ."""
        return self._freed(x, rows) @ push.T

    def fastest(self, place: Place, xi: np.ndarray) -> np.ndarray:
        """Return how fast each gap could close with the kinetic energy of its sites."""
        mass, _, _ = self._of_mass(place.x)
        v = xi.reshape(self.N, self.m)
        twice = np.einsum("ia,iab,ib->i", v, mass, v)
        of_gaps = [np.repeat(twice[term.ends[term.which]].sum(axis=1), term.K)
                   for term in self.terms]  # fmt: skip
        moved, normal = self._freed(place.x, place.normal), place.normal
        both = moved * normal if isinstance(moved, np.ndarray) else moved.multiply(normal)
        weight = np.asarray(both.sum(axis=1)).ravel()
        return np.asarray(abs(weight * np.concatenate(of_gaps)) ** 0.5)

    def struck_with(self, closed: np.ndarray, closing: np.ndarray) -> np.ndarray:
        """Return the closed gaps that are joined to a closing one by sites that move."""
        joins = self._joins[closed]
        label = np.full(len(closed), -1)
        label[closed] = _labels(joins @ joins.T)
        return closed & np.isin(label, label[closing])

    @cached_property
    def _joins(self) -> MatrixLike:
        """1 for each gap and each of its sites that move, (gaps, N)."""
        parts = []
        for term in self.terms:
            ends = np.repeat(term.ends[term.which], term.K, axis=0)
            rows = np.repeat(np.arange(len(ends)), ends.shape[1])
            values = self.lattice.free[ends].astype(float).ravel()
            made = sparse.csr_matrix((values, (rows, ends.ravel())), (len(ends), self.N))
            made.eliminate_zeros()
            parts.append(made)
        return sparse.vstack(parts, format="csr")

    def impulses(
        self, W: MatrixLike, U0: np.ndarray, cones: Cones, start: np.ndarray
    ) -> np.ndarray:
        """Return P ≥ 0 with U = U₀ + W P ≥ 0 and P U = 0, for each component of gaps by itself.

        Raises `CannotMeasure` if none is found.
        """
        P, failed = np.maximum(0 * U0, -scaling(W, cones) * U0), False  # of a gap alone
        dense = isinstance(W, np.ndarray)
        for some in _components(sparse.csr_matrix(W != 0) if dense else W):
            try:
                own = W[some][:, some] if dense else W[some][:, some].toarray()
                P[some] = super().impulses(own, U0[some], Cones(len(some), {}), start[some])
            except NotFound as failure:
                P[some], failed = failure.near, True
        if failed:
            raise NotFound(P)
        return P

    def energy(self, x: np.ndarray, xi: np.ndarray, mu: np.ndarray) -> Number:
        """Return H of all sites and bonds that move: that of others may change with the time."""
        pairs, free = self.lattice.pairs, self.lattice.free
        (_, p, _), (_, of_bond, _) = self._terms_at(x)
        of_bonds = self._of_bond(*at_ends(pairs, self.of_sites(x)), of_bond)
        columns = (list(e.reshape(self.N, -1).T) for e in (self.of_sites(x), xi, mu))
        of_sites = self._energy(*columns, p)
        return (np.broadcast_to(of_sites, self.N)[free].sum()
                + np.broadcast_to(of_bonds, len(pairs))[free[pairs].any(axis=1)].sum()
                )  # fmt: skip

    @cached_property
    def _of_bond(self) -> Function:
        bond = self.flow.scheme.terms[1][0]
        return numeric({"x": bond.x, "p": bond.parameter_list}, [-bond.lagrangian], self.numbers,
                       columns=True)  # fmt: skip


def _labels(matrix: MatrixLike) -> np.ndarray:
    """Return the number of the connected component of each row of a symmetric sparse matrix."""
    if not matrix.shape[0]:
        return np.zeros(0, dtype=int)
    labels: np.ndarray = graphs.connected_components(matrix, directed=False)[1]
    return labels


def _components(matrix: MatrixLike) -> list[np.ndarray]:
    """Return the rows of each connected component of a symmetric sparse matrix, two or more."""
    if matrix.nnz <= matrix.shape[0]:
        return []  # it is diagonal
    labels = _labels(matrix)
    order = np.argsort(labels, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(labels[order])) + 1)
    return [some for some in groups if len(some) > 1]


def _each(flow: LatticeFlow, values: np.ndarray, shape: tuple[int, ...], count: int) -> np.ndarray:
    """Return the values of `count` sites, (count, *shape), from columns or shared values."""
    columns = np.broadcast_to(flow.exact(values).reshape(*shape, -1), (*shape, count))
    return np.ascontiguousarray(np.moveaxis(columns, -1, 0))
