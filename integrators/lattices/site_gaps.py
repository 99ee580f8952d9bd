"""The gaps φ(x) ≥ 0 of all sites of a lattice: `contact.Gaps` with sparse matrices.

Vectors of x, ξ, μ and φ hold site after site. If bonds have no velocities, each site has its own
mass matrix: an impulse at a site changes the velocity of another one only through the bonds within
a step. The iteration solves for P ≥ 0 with U₀ + W P ≥ 0, U₀ = φ/h − W P. It reduces that error by
the factor (hω)²/(4 + (hω)²) (midpoint rule, ω the fastest motion), or removes it at once if forces
are taken at the ends of the step: the number of free steps in a step does not grow with the sites.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..contact import (
    BESIDE,
    SWEEPS,
    TOUCHING,
    Cones,
    Gaps,
    NotFound,
    Place,
    gap_functions,
    opposed,
    scaling,
    solved,
)
from ..equations import SceneSymbols, legendre_inverse
from ..errors import BadInput, CannotMeasure
from ..numbers import Double, LazyModule, numeric
from ..numbers.types import MatrixLike
from .blocks import at_ends

if TYPE_CHECKING:
    from .lattice_flow import LatticeFlow

sparse: Any = LazyModule("scipy.sparse")
NUMBERS = Double()
EPS = NUMBERS.eps


class SiteGaps(Gaps):
    """The gaps of the moving sites of a lattice, K per site, without friction.

    Raises `BadInput` for gaps that are not expressions of x and p, or that have coordinates of a
    plane, `CannotMeasure` for a site's Lagrangian that is not quadratic in the velocity.
    """

    def __init__(self, flow: LatticeFlow) -> None:
        self.flow, self.lattice, self.numbers = flow, flow.lattice, NUMBERS
        scheme, name, free = flow.scheme, flow.lattice.name, flow.lattice.free
        s: SceneSymbols
        (s, self.p, _), (bond, self._bond_p, _) = scheme.terms
        made = gap_functions(s, scheme.equations.contact, NUMBERS, columns=True)
        coordinates, self._place, self._phi, self._motion, self._energy = made
        if any(e is not None for e in coordinates):
            raise BadInput(f"{name}: the contact of a lattice has no friction; give gaps φ alone, "
                           "without the coordinates of a plane.")  # fmt: skip
        if not legendre_inverse(s, NUMBERS).quadratic:
            raise CannotMeasure(f"{name}: contact on a lattice needs a kinetic energy that is "
                                "quadratic in the velocity.")  # fmt: skip
        self.quadratic, self.rough, self.friction, self.coordinates = True, False, [], []
        self._of_bond = numeric({"x": bond.x, "p": bond.parameter_list}, [-bond.lagrangian],
                                NUMBERS, columns=True)  # fmt: skip
        self.sites, self.K = np.flatnonzero(free), len(coordinates)
        self._free_p = [e[free] if np.ndim(e) else e for e in self.p]
        (self.N, self.n), self.m = self.lattice.start[0].shape, len(s.u)
        self.count = self.K * len(self.sites)
        self._last: tuple[Any, Any] = None, None

    def phi(self, rows: np.ndarray) -> np.ndarray:
        """Return φ of all sites, (r, N, K), at rows of x (r, N, n)."""
        p = [np.tile(e, len(rows)) if np.ndim(e) else e for e in self.p]
        found = self._phi(list(rows.reshape(-1, self.n).T), p)
        return _each(found, (self.K,), rows.shape[0] * self.N).reshape(*rows.shape[:2], self.K)

    def at(self, x: np.ndarray, reach: np.ndarray | float = 0) -> Place:
        """Return the gaps at x.

        `own` includes the round-off that Newton's method leaves, which is that of its whole
        solution, not of each site.
        """
        phi, own, slope, normal = self._of_sites(x.reshape(self.N, self.n)[self.sites])
        phi, own, steep = phi.ravel(), own.ravel(), abs(slope).sum(axis=2).ravel()
        places = self.m * np.repeat(self.sites, self.K)[:, None] + np.arange(self.m)
        ends = np.arange(0, normal.size + 1, self.m)
        of_all = sparse.csr_matrix((normal.ravel(), places.ravel(), ends),
                                   (self.count, self.N * self.m))  # fmt: skip
        size = own + reach
        closed = abs(phi) <= TOUCHING * EPS * size
        known = own + steep * abs(x).max()
        return Place(x.ravel(), phi, known, size, of_all, [], [], [], steep, closed)

    def _of_sites(self, rows: np.ndarray) -> list[np.ndarray]:
        """Return φ, the size that determines its round-off, φ′ and the normal row of each site.

        At the centre of a distance, where its slope is 0/0, a point beside it is taken, as in
        `Gaps`.
        """

        def found(at: np.ndarray) -> list[np.ndarray]:
            with np.errstate(all="ignore"):
                values = self._place(list(at.T), self._free_p)
            shapes = (self.K,), (self.K,), (self.K, self.n), (self.K, self.m)
            return [_each(e, shape, len(at)) for e, shape in zip(values, shapes, strict=False)]

        parts = found(rows)
        for power in BESIDE:
            lost = ~np.isfinite(parts[2]).all(axis=(1, 2))
            if not lost.any():
                break
            beside = found(rows + (4 * EPS) ** (power / 2) * (1 + abs(rows)))
            parts[1:] = [np.where(lost.reshape(-1, *[1] * (e.ndim - 1)), b, e)
                         for e, b in zip(parts[1:], beside[1:], strict=True)]  # fmt: skip
        return parts

    def at_start(self, x: np.ndarray) -> Place:
        """Return the gaps at a start, which is known to the round-off of its largest coordinate."""
        return self.at(x, self.at(x).scale * max(abs(x).max(), abs(self.lattice.start[0]).max()))

    def check(self, x: np.ndarray) -> None:
        """Raise `BadInput` unless x (N, n) is outside the obstacle, with room to move."""
        place, name = self.at_start(x.ravel()), self.lattice.name
        for k in np.flatnonzero(~(place.phi >= -TOUCHING * EPS * place.size))[:1]:
            raise BadInput(f"{name}: x0 of site {self.sites[k // self.K]} is inside the obstacle: "
                           f"its gap {k % self.K} is {place.phi[k]:.3g}; begin outside."
                           )  # fmt: skip
        normals = place.normal[place.closed]
        for k in np.flatnonzero(place.closed)[~(abs(normals).max(axis=1).toarray().ravel() > 0)]:
            raise BadInput(f"{name}: gap {k % self.K} of site {self.sites[k // self.K]} is closed "
                           "at x0 and no motion changes it there; write it with a slope (a "
                           "distance has one).")  # fmt: skip
        closed = place.closed.reshape(-1, self.K)
        for i in np.flatnonzero(closed.sum(axis=1) > 1):
            if opposed(place.normal[self.K * i + np.flatnonzero(closed[i])].toarray()):
                raise BadInput(f"{name}: closed gaps of site {self.sites[i]} contradict each other "
                               "at x0: they leave no direction to move in; fix the site."
                               )  # fmt: skip

    def velocity(self, x: np.ndarray, mu: np.ndarray, near: np.ndarray | None = None) -> np.ndarray:
        """Return ξ(x, μ); it is 0 at fixed sites."""
        _, back, still = self._of_mass(x)
        found = np.einsum("iab,ib->ia", back, mu.reshape(self.N, self.m) - still)
        return np.asarray(found * self.lattice.free[:, None]).ravel()

    def _of_mass(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return ∂μ/∂ξ, ∂ξ/∂μ (N, m, m) and ∂l/∂ξ at rest (N, m) by site; one x is kept."""
        if x is not self._last[0]:
            rows, shape = x.reshape(self.N, self.n), (self.N, self.m, self.m)
            mass, still = self._motion(list(rows.T), [0.0] * self.m, self.p)
            # a mass of 10²⁹ is an integer that numpy's integers cannot hold
            mass = np.asarray(mass, dtype=float)
            back = np.linalg.inv(mass.T)  # a single matrix, if all sites have the same
            mass, back = (np.broadcast_to(e, shape) for e in (mass.T, back))
            self._last = x, (mass, back, _each(still, (self.m,), self.N))
        return self._last[1]

    def inverse_mass(self, x: np.ndarray, xi: np.ndarray) -> MatrixLike:
        """Return ∂ξ/∂μ as a sparse matrix."""
        (_, back, _), k = self._of_mass(x), self.m
        places = np.arange(self.N * k).reshape(self.N, 1, k) + np.zeros((k, 1), dtype=int)
        ends = np.arange(0, back.size + 1, k)
        return sparse.csr_matrix((back.ravel(), places.ravel(), ends), (self.N * k, self.N * k))

    def fastest(self, place: Place, xi: np.ndarray) -> np.ndarray:
        """Return how fast each gap could close with the kinetic energy of its site."""
        mass, back, _ = (e[self.sites] for e in self._of_mass(place.x))
        normal = place.normal.data.reshape(len(self.sites), self.K, self.m)
        v = xi.reshape(self.N, self.m)[self.sites]
        weight = np.einsum("ika,iab,ikb->ik", normal, back, normal)
        twice = np.einsum("ia,iab,ib->i", v, mass, v)
        return np.asarray(np.sqrt(abs(weight * twice[:, None]))).ravel()

    def struck_with(self, closed: np.ndarray, closing: np.ndarray) -> np.ndarray:
        """Return the closed gaps of the sites where a gap is closing."""
        return closed & np.repeat(closing.reshape(-1, self.K).any(axis=1), self.K)

    def impulses(
        self, W: MatrixLike, U0: np.ndarray, cones: Cones, start: np.ndarray
    ) -> np.ndarray:
        """Return P ≥ 0 with U = U₀ + W P ≥ 0 and P U = 0, by sweeps over one gap of every site.

        Raises `CannotMeasure` if none is found.
        """
        P, r = start.copy(), scaling(W, cones)
        if self.K == 1:
            return np.maximum(0, -r * U0)
        # rank of each gap among those of its site
        rank = np.diff(sparse.tril(W, -1, format="csr").indptr)
        turns = [np.flatnonzero(rank == k) for k in range(rank.max(initial=0) + 1)]
        parts = [W[turn] for turn in turns]
        for _ in range(SWEEPS):
            for turn, part in zip(turns, parts, strict=True):
                P[turn] = np.maximum(0, P[turn] - r[turn] * (U0[turn] + part @ P))
            if solved(P, U0, W, r, cones, NUMBERS):
                return P
        raise NotFound(P)

    def energy(self, x: np.ndarray, xi: np.ndarray, mu: np.ndarray) -> float:
        """Return H of all sites and bonds."""
        pairs = self.lattice.pairs
        of_bonds = self._of_bond(*at_ends(pairs, x.reshape(self.N, self.n)), self._bond_p)
        columns = (list(e.reshape(self.N, -1).T) for e in (x, xi, mu))
        of_sites = self._energy(*columns, self.p)
        return float(np.broadcast_to(of_sites, self.N).sum()
                     + np.broadcast_to(of_bonds, len(pairs)).sum())  # fmt: skip


def _each(values: np.ndarray, shape: tuple[int, ...], count: int) -> np.ndarray:
    """Return the values of `count` sites, (count, *shape), from columns or shared values."""
    columns = np.broadcast_to(values.reshape(*shape, -1), (*shape, count))
    return np.ascontiguousarray(np.moveaxis(columns, -1, 0))
