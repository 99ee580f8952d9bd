"""The gaps φ(x) ≥ 0 of all sites of a lattice as arrays: slopes, velocities, impulses, energy.

What `contact.Gaps` is for a scene, of gaps that each hold one site, without friction. Where no bond
moves, the mass matrix is each site's own: an impulse at a site changes no velocity of another one.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..contact import NOT_FOUND, ROUNDED, SWEEPS, TOUCHING, gap_expressions, opposed
from ..equations import SceneSymbols, energy, legendre_inverse, mass_matrix, natural_structure
from ..errors import BadInput, CannotMeasure
from ..numbers import Double, jacobian, numeric, sympy
from .velocities import velocities

NUMBERS = Double()
EPS = NUMBERS.eps


class SitePlace(NamedTuple):
    """The gaps at places x (N, n) of the sites, K a site.

    phi, own, size, slope (N, K): their values, what their round-off is a part of here, what it is
    with the way that led here, and Σ |φ′|; normal (N, K, m): φ′ρ̂; mass (N, m, m): ∂μ/∂ξ; closed
    (N, K): whether a gap is 0 to round-off, False at fixed sites.
    """

    x: np.ndarray
    phi: np.ndarray
    own: np.ndarray
    size: np.ndarray
    slope: np.ndarray
    normal: np.ndarray
    mass: np.ndarray
    closed: np.ndarray


class SiteGaps:
    """The gaps of a lattice's sites, and what their velocities follow from.

    Raises `BadInput` for gaps that are no expressions of x and p, or have coordinates of a plane,
    `CannotMeasure` for a site's Lagrangian that is not quadratic in the velocity.
    """

    def __init__(self, flow: Any) -> None:
        self.flow, scheme, lattice = flow, flow.scheme, flow.lattice
        self.lattice, self.free = lattice, lattice.free[:, None]
        s: SceneSymbols = scheme.equations.site.s
        phi, coordinates = gap_expressions(s, scheme.equations.contact)
        if any(e is not None for e in coordinates):
            raise BadInput(f"{lattice.name}: the contact of a lattice has no friction; give gaps φ "
                           "alone, without the coordinates of a plane.")  # fmt: skip
        if not legendre_inverse(s, NUMBERS).quadratic:
            raise CannotMeasure(f"{lattice.name}: contact on a lattice needs a kinetic energy that "
                                "is quadratic in the velocity.")  # fmt: skip
        self.count = len(phi)
        slope = jacobian(phi, s.x)
        size = [sympy.Add(*map(abs, sympy.Add.make_args(e)),
                          *(abs(d * x) for d, x in zip(row, s.x, strict=True)))
                for e, row in zip(phi, slope.tolist(), strict=True)]  # fmt: skip
        steep = sympy.Matrix([sum(map(abs, row)) for row in slope.tolist()])
        normal = slope * natural_structure(s, s.x)[0]
        given = {"x": s.x, "p": s.parameter_list}
        moving = {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}
        self._of_place = numeric(
            given, [phi, sympy.Matrix(size), steep, normal, mass_matrix(s)], NUMBERS, columns=True
        )
        self._of_site = numeric(moving, [energy(s)], NUMBERS, columns=True)
        bond = scheme.equations.bond_symbols
        self._of_bond = numeric({"x": bond.x, "p": bond.parameter_list}, [-bond.lagrangian],
                                NUMBERS, columns=True)  # fmt: skip
        self._p, self._bond_p = (
            [columns[e] for e in letters]
            for letters, columns in ((s.parameter_list, scheme.site_columns),
                                     (bond.parameter_list, scheme.bond_columns))
        )  # fmt: skip

    def at(self, x: np.ndarray, reach: Any = 0, largest: float = 0) -> SitePlace:
        """The gaps at the places; reach (N, K): sizes of what was added up on the way there.

        largest: of what every coordinate is known to the round-off.
        """
        found = (e.reshape(*e.shape[:2], -1) for e in self._of_place(list(x.T), self._p))
        shaped = (np.moveaxis(np.broadcast_to(e, (*e.shape[:2], len(x))), 2, 0) for e in found)
        *columns, normal, mass = (e.copy() for e in shaped)
        phi, own, slope = (e[:, :, 0] for e in columns)
        size = own + slope * largest + reach
        closed = (abs(phi) <= TOUCHING * EPS * size) & self.free
        return SitePlace(x, phi, own, size, slope, normal, mass, closed)

    def at_start(self, x: np.ndarray) -> SitePlace:
        """The gaps at a start, which is known to the round-off of its largest coordinate."""
        return self.at(x, largest=max(abs(x).max(), abs(self.lattice.start[0]).max()))

    def check(self, x: np.ndarray) -> None:
        """Raise `BadInput` unless x (N, n) is outside the obstacle, with room to move."""
        place, name = self.at_start(x), self.lattice.name
        bad = self.free & ~(place.phi >= -TOUCHING * EPS * place.size)
        if bad.any():
            i, k = np.argwhere(bad)[0]
            raise BadInput(f"{name}: x0 of site {i} is inside the obstacle: its gap {k} is "
                           f"{place.phi[i, k]:.3g}; begin outside.")  # fmt: skip
        flat = place.closed & ~(abs(place.normal).max(axis=2) > 0)
        if flat.any():
            i, k = np.argwhere(flat)[0]
            raise BadInput(f"{name}: gap {k} of site {i} is closed at x0 and no motion changes it "
                           "there; write it with a slope (a distance has one).")  # fmt: skip
        for i in np.flatnonzero(place.closed.sum(axis=1) > 1):
            if opposed(place.normal[i][place.closed[i]]):
                raise BadInput(f"{name}: closed gaps of site {i} contradict each other at x0: they "
                               "leave no direction to move in; fix the site.")  # fmt: skip

    def velocity(self, x: np.ndarray, mu: np.ndarray) -> np.ndarray:
        """ξ(x, μ), (N, m), 0 at fixed sites."""
        return velocities(self.flow, x[None], mu[None], 0 * mu[None])[0]

    def energy(self, x: np.ndarray, xi: np.ndarray, mu: np.ndarray) -> float:
        """H of all sites and bonds."""
        pairs = self.lattice.pairs
        ends = list(x[pairs].reshape(len(pairs), -1).T)
        of_bonds = np.broadcast_to(self._of_bond(ends, self._bond_p), len(pairs)).sum()
        of_sites = self._of_site(list(x.T), list(xi.T), list(mu.T), self._p)
        return float(np.broadcast_to(of_sites, len(x)).sum() + of_bonds)


def applied(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Each site's matrix times its vector."""
    found: np.ndarray = (matrices @ vectors[:, :, None])[:, :, 0]
    return found


def flexibility(place: SitePlace) -> np.ndarray:
    """How impulses of a site's gaps change their rates, (N, K, K)."""
    found: np.ndarray = place.normal @ np.linalg.solve(place.mass, np.swapaxes(place.normal, 1, 2))
    return found


def scaling(W: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """An impulse for a rate, of the gaps of `mask` (N, K); else 0."""
    return np.where(mask, 1 / np.where(mask, np.diagonal(W, axis1=1, axis2=2), 1), 0)


def rates(place: SitePlace, xi: np.ndarray) -> np.ndarray:
    """How fast the gaps open, (N, K)."""
    return applied(place.normal, xi)


def pushed(place: SitePlace, P: np.ndarray) -> np.ndarray:
    """What impulses of the gaps (N, K) add to the momenta, (N, m)."""
    return applied(np.swapaxes(place.normal, 1, 2), P)


def impulses(W: np.ndarray, U0: np.ndarray, mask: np.ndarray, start: np.ndarray) -> np.ndarray:
    """P ≥ 0 of the gaps of `mask` (N, K) with U = U₀ + W P ≥ 0 and P U = 0, by sweeps; else P = 0.

    One sweep where a site has one gap. Raises `CannotMeasure` where none is found.
    """
    P = np.where(mask, start, 0.0)
    r = scaling(W, mask)
    for _ in range(SWEEPS):
        for k in range(P.shape[1]):
            U = U0[:, k] + (W[:, k] * P).sum(axis=1)
            P[:, k] = np.maximum(0, P[:, k] - r[:, k] * U)
        U = U0 + applied(W, P)
        left = abs(P - np.maximum(0, P - r * U))
        parts = abs(U0) + applied(abs(W), P)
        if (left <= ROUNDED * EPS * (P + r * parts)).all():
            return P
    raise CannotMeasure(NOT_FOUND)
