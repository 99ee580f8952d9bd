"""The gaps φ(x) ≥ 0 of a scene, as numbers: slopes, planes of contact, velocities and energy.

The normal row of a gap is A = φ′ρ̂, so that dφ/dt = A ξ and Aᵀλ is the force of a multiplier λ. In
the plane of contact the touching point has coordinates t(x), whose rates T ξ are its slip: those
that the scene gives, or x itself without its part along φ′, in an orthonormal basis of the plane.
"""

from __future__ import annotations

from contextlib import suppress
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from ..equations import (
    SceneSymbols,
    energy,
    legendre_inverse,
    mass_matrix,
    momentum,
    natural_structure,
)
from ..errors import BadInput, shown
from ..numbers import Arithmetic, finite, flatten, jacobian, numeric, sympy
from ..numbers.types import Column, Number, Vector
from ..scene import Scene
from .bounds import GapBounds
from .cones import Cones, impulses, length

BESIDE = (2, 1)  # half powers of round-off, by which a point with slopes is beside one without
TOUCHING = 128  # units of round-off of its size within which a gap is closed


class Place(NamedTuple):
    """The gaps at a point x, K of them.

    phi, own, size (K,): their values, what their round-off is a part of here, and what it is with
    the way that led here; normal (K, m); slip: of each gap T (d, m); bases: of each gap an
    orthonormal basis of its plane, in the coordinates that the scene gives, or in x; where: of each
    gap its t(x); scale (K,): |φ′| where T is in its units, else 1; closed (K,): whether a gap is 0
    to round-off.
    """

    x: Vector
    phi: Vector
    own: Vector
    size: Vector
    normal: Any
    slip: list[np.ndarray]
    bases: list[Any]
    where: list[Vector]
    scale: Vector
    closed: Vector
    breadth: Any = ()
    rho: Any = None

    def moved(self, i: int, other: Place) -> Vector:
        """How far the touching point of gap i has moved along its plane, from here to there."""
        found: Vector = (other.where[i] - self.where[i]) @ self.bases[i]
        return found


class Gaps:
    """The gaps of a scene in an arithmetic, and what their velocities follow from.

    friction (K,). Raises `BadInput` for gaps that are no expressions of x and p, coordinates
    without a gap, another number of coefficients than of gaps, and friction in a base of 1.
    """

    #: the side of the slip that friction acts against; −1 is a control
    against = 1

    def __init__(self, s: SceneSymbols, scene: Scene, numbers: Arithmetic) -> None:
        self.s, self.scene, self.numbers, self.n = s, scene, numbers, s.n
        self.p = [numbers.number(e) for e in scene.parameter_values]
        made = gap_functions(s, scene.contact, numbers)
        self.coordinates, self._place, self._phi, self._motion, self._energy = made
        self.count = len(self.coordinates)
        given = flatten((scene.friction,))
        if isinstance(scene.friction, tuple) and len(given) != self.count:
            raise BadInput(
                f"{s.name}: friction has {len(given)} entries; give one for each gap, {self.count}."
            )
        spread = given if isinstance(scene.friction, tuple) else given * self.count
        self.friction = [numbers.number(e) for e in spread]
        self._own_basis = [numbers.identity(len(e or ())) for e in self.coordinates]
        self.rough = any(e > 0 for e in self.friction)
        for i, (e, own) in enumerate(zip(self.friction, self.coordinates, strict=True)):
            if e > 0 and own is None and s.n == 1:
                raise BadInput(
                    f"{s.name}: gap {i} has friction, but a base of 1 has no plane of contact; "
                    "give the coordinates along which it slips, (φ, [t, …])."
                )
        self._legendre = legendre_inverse(s, numbers)
        #: whether ξ is affine in μ
        self.quadratic = self._legendre.quadratic

    @cached_property
    def still(self) -> np.ndarray:
        """No impulses, (K, 1 + D): of each gap the normal one, and those along its coordinates, if
        it has friction."""
        rough = (e for e, kappa in zip(self.coordinates, self.friction, strict=True) if kappa > 0)
        width = 1 + max((self.n if e is None else len(e) for e in rough), default=0)
        found: np.ndarray = self.numbers.zeros(self.count, width)
        return found

    def phi(self, rows: np.ndarray) -> np.ndarray:
        """φ at rows of x, (r, K)."""
        if self.numbers.dtype is object:
            return np.array([self._phi(x, self.p) for x in rows])
        return np.array(np.broadcast_to(self._phi(rows.T, self.p).T, (len(rows), self.count)))

    def _made(self, x: Vector) -> Any:
        """The numbers that `at` is made of. A distance has no slope at its centre, where it is 0/0:
        there all but φ is taken at a point beside x, as near as round-off lets a slope exist."""
        try:
            found = self._place(x, self.p)
            if finite(found[2]).all():
                return found
        except ArithmeticError:
            pass
        for power in BESIDE:
            with suppress(ArithmeticError):
                away = (4 * self.numbers.eps) ** (self.numbers.number(power) / 2)
                _, *rest = self._place(x + away * (1 + abs(x)), self.p)
                if finite(rest[1]).all():
                    return [self.phi(x[None])[0], *rest]
        return self._place(x, self.p)

    def at(self, x: Vector, reach: Any = 0) -> Place:
        """The gaps at a point; reach (K,): sizes of what was added up on the way to it."""
        phi, own_size, slope, normal, rho, own, own_slope, own_breadth = self._made(x)
        slip, bases, where, scale, breadth, first = [], [], [], [], [], 0
        for i, coordinates in enumerate(self.coordinates):
            last = first + len(coordinates or ())
            if coordinates is None and self.friction[i] > 0:
                scale.append(length(slope[i]))
                bases.append(_plane(slope[i] / scale[i]))
                where.append(x[: self.n])
                breadth.append(abs(x[: self.n]).max())
                slip.append(bases[i].T @ rho)
            else:
                scale.append(1 + 0 * phi[i])
                bases.append(self._own_basis[i])
                where.append(own[first:last])
                breadth.append(max(own_breadth[first:last], default=0 * phi[i]))
                slip.append(own_slope[first:last])
            first = last
        size = own_size + reach
        closed = abs(phi) <= TOUCHING * self.numbers.eps * size
        scales, breadths = np.array(scale), np.array(breadth)
        return Place(x, phi, own_size, size, normal, slip, bases, where, scales, closed,
                     breadths, rho)  # fmt: skip

    def at_start(self, x: Vector) -> Place:
        """The gaps at a start, which is known to the round-off of its largest coordinate."""
        slope, known = self._made(x)[2], [*x[: self.n], *self.scene.x0]
        largest = max(abs(self.numbers.number(e)) for e in known)
        return self.at(x, abs(slope).sum(axis=1) * largest)

    def velocity(self, x: Vector, mu: Vector, near: Vector) -> Vector:
        """ξ(x, μ), m; `near`: one nearby."""
        if self.quadratic:
            mass, still = self._motion(x, 0 * mu, self.p)
            solved: Vector = self.numbers.solve(mass, mu - still)
            return solved
        found: Vector = self._legendre(x[None], mu[None], self.p, near[None])[0]
        return found

    def flexibility(self, x: Vector, xi: Vector, rows: np.ndarray, push: np.ndarray) -> np.ndarray:
        """rows M⁻¹ pushᵀ: how impulses along `push` change the velocities along `rows`."""
        changed: np.ndarray = rows @ self.inverse_mass(x, xi) @ push.T
        return changed

    def struck_with(self, closed: Vector, closing: Vector) -> Vector:
        """Which of the closed gaps may push where some are closing: all, being of one system."""
        return closed

    def fastest(self, place: Place, xi: Vector) -> Vector:
        """How fast each gap could close with the kinetic energy of ξ, (K,), in any units.

        √(A M⁻¹Aᵀ · ξ·M ξ), which is |A ξ| at least (Cauchy and Schwarz).
        """
        return self.weights(place, xi)[1]

    def weights(self, place: Place, xi: Vector) -> tuple[Vector, Vector]:
        """(A M⁻¹Aᵀ of each gap, what an impulse changes its velocity by, (K,); `fastest`)."""
        mass, _ = self._motion(place.x, xi, self.p)
        weight = abs((place.normal * self.numbers.solve(mass, place.normal.T).T).sum(axis=1))
        speeds: Vector = (weight * abs(xi @ mass @ xi)) ** 0.5
        return weight, speeds

    def inverse_mass(self, x: Vector, xi: Vector) -> np.ndarray:
        """∂ξ/∂μ, m×m."""
        mass, _ = self._motion(x, xi, self.p)
        found: np.ndarray = self.numbers.solve(mass, self.numbers.identity(len(xi)))
        return found

    @cached_property
    def bounds(self) -> GapBounds:
        """Bounds of the gaps over boxes."""
        values = [float(e) for e in self.scene.parameter_values]
        return gap_bounds(self.s, self.scene.contact, tuple(values))

    def impulses(self, W: np.ndarray, U0: Vector, cones: Cones, start: Vector) -> Vector:
        """P in the cones with the velocities U₀ + W P (`cones.impulses`)."""
        return impulses(W, U0, cones, self.numbers, start)

    def energy(self, x: Vector, xi: Vector, mu: Vector) -> Number:
        """H at (x, ξ, μ)."""
        return self._energy(x, xi, mu, self.p)


def _plane(normal: Vector) -> np.ndarray:
    """An orthonormal basis of the plane across a unit vector, n×(n−1), by a reflection."""
    n, along = len(normal), normal.copy()
    along[0] += 1 if normal[0] >= 0 else -1
    one = np.eye(n, dtype=int) + 0 * normal[0]
    return (one - 2 * np.outer(along, along) / (along @ along))[:, 1:]


def gap_expressions(s: SceneSymbols, contact: Any) -> tuple[Column, list[Any]]:
    """The gaps, K×1, and of each the coordinates of its plane, or None where it gives none."""
    what = "its contact"
    given = s.evaluated(contact, what, s.position, s.parameters)
    if not _listed(given):
        raise BadInput(
            f"{s.name}: contact= gives {shown(given)}, but must give a list of gaps φ(x), or of "
            "(φ, [t, …]) with the coordinates along which the touching point slips."
        )
    gaps, coordinates = [], []
    for i, e in enumerate(list(given)):
        split = isinstance(e, (tuple, list))
        if split and (len(e) != 2 or not _listed(e[1])):
            raise BadInput(f"{s.name}: gap {i} is {shown(e)}; give φ, or (φ, [t, …]).")
        gaps.append(e[0] if split else e)
        coordinates.append(s.scalars(list(e[1]), what, contact) if split else None)
    phi = s.scalars(gaps, what, contact)
    for column in (phi, *(e for e in coordinates if e is not None)):
        s.refuse_unknown(column, {*s.position}, what, contact, "x and p")
    for i, e in enumerate(phi):
        if not e.free_symbols & {*s.position}:
            raise BadInput(
                f"{s.name}: gap {i} is {shown(e)}, which no motion changes; leave it out."
            )
    return phi, coordinates


def _listed(given: Any) -> bool:
    """Whether something is a list with entries, or a column, and no dictionary or text."""
    return isinstance(given, (tuple, list, np.ndarray, sympy.MatrixBase)) and len(given) > 0


@lru_cache(maxsize=64)
def gap_functions(
    s: SceneSymbols, contact: Any, numbers: Arithmetic, columns: bool = False
) -> tuple[Any, ...]:
    """The coordinates (`gap_expressions`), and functions: what `Gaps.at` needs; φ, of columns in
    double precision; M and ∂l/∂ξ; H. columns: of all."""
    phi, coordinates = gap_expressions(s, contact)
    own = sympy.Matrix([e for part in coordinates for e in part or ()])
    rho = natural_structure(s, s.x)[0][: s.n, :]
    slope = jacobian(phi, s.position)

    def sizes(values: Any, slopes: Any) -> list[Any]:
        """What the round-off of each value is a part of: its terms, and its changes with x."""
        return [
            sympy.Add(*map(abs, sympy.Add.make_args(e)), *(abs(d * x) for d, x in
                    zip(row, s.position, strict=True)))
            for e, row in zip(values, slopes.tolist(), strict=True)
        ]  # fmt: skip

    given: dict[str, Any] = {"x": s.x, "p": s.parameter_list}
    results: list[Any] = [list(phi), sizes(phi, slope), slope, slope * rho, rho]
    own_slope = jacobian(own, s.position) if len(own) else own
    results += [list(own), own_slope * rho, sizes(own, own_slope)] if len(own) else [[], [], []]
    moving = {"x": s.x, "u": s.u, "p": s.parameter_list}
    with_momentum = {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}
    return (
        coordinates,
        numeric(given, results, numbers, columns=columns),
        numeric(given, [list(phi)], numbers, columns=numbers.dtype is not object),
        numeric(moving, [mass_matrix(s), list(momentum(s))], numbers, columns=columns),
        numeric(with_momentum, [energy(s)], numbers, columns=columns),
    )


@lru_cache(maxsize=64)
def gap_bounds(s: SceneSymbols, contact: Any, parameters: tuple[float, ...]) -> GapBounds:
    """The bounds of the gaps of a scene with these values of its parameters."""
    phi, _ = gap_expressions(s, contact)
    known = dict(zip(s.parameter_list, parameters, strict=True))
    return GapBounds(list(s.position), list(phi), jacobian(phi, s.position), known)
