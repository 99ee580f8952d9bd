"""The gaps φ(x) ≥ 0 of a scene in numbers: slopes, planes of contact, velocities and energy.

The normal row of a gap is A = φ′ρ̂, so that dφ/dt = A ξ and Aᵀλ is the force of a multiplier λ. In
the plane of contact the touching point has coordinates t(x), whose rates T ξ are its slip: the
coordinates that the scene gives, or x itself without its part along φ′, in an orthonormal basis of
the plane.
"""

from __future__ import annotations

from contextlib import suppress
from functools import cached_property, lru_cache
from typing import NamedTuple, TypeAlias

import numpy as np

from ...equations import (
    SceneSymbols,
    energy,
    legendre_inverse,
    mass_matrix,
    momentum,
    natural_structure,
)
from ...errors import BadInput, shown
from ...numbers import Arithmetic, Matrix, Numbers, finite, flatten, jacobian, numeric, sympy
from ...numbers.numeric import Result
from ...numbers.types import (
    Column,
    Expression,
    Function,
    MatrixLike,
    Number,
    SymbolicMatrix,
    Vector,
)
from ...scene import Scene
from .bounds import GapBounds
from .cones import Cones, impulses, length

GapFunction: TypeAlias = Function  # a scene's contact=: (x, p) ↦ its gaps

# powers of √round-off: relative distances at which a slope is taken beside a point without one
BESIDE = (2, 1)
TOUCHING = 128  # a gap is closed if it is at most so many units of the round-off of its size


class Place(NamedTuple):
    """The K gaps at a point x.

    phi (K,): their values; own, size (K,): the sizes that determine the round-off of φ, at this
    point alone and with the path that led here; normal (K, m); slip: for each gap T (d, m); bases:
    for each gap an orthonormal basis of its plane, in the coordinates that the scene gives, or in
    x; where: for each gap t(x); scale (K,): |φ′| if T is in its units, else 1; closed (K,): True if
    a gap is 0 to round-off; breadth (K,): the size that determines the round-off of t(x).
    """

    x: Vector
    phi: Vector
    own: Vector
    size: Vector
    normal: MatrixLike
    slip: list[np.ndarray]
    bases: list[Matrix]
    where: list[Vector]
    scale: Vector
    closed: Vector
    breadth: Numbers = ()
    rho: MatrixLike | None = None

    def moved(self, i: int, other: Place) -> Vector:
        """Return how far gap i's touching point has moved along its plane, from here to there."""
        shift: Vector = (other.where[i] - self.where[i]) @ self.bases[i]
        return shift


class Gaps:
    """The gaps of a scene in an arithmetic, and the functions that give their velocities.

    friction (K,). Raises `BadInput` for gaps that are not expressions of x and p, coordinates
    without a gap, a number of coefficients other than that of the gaps, and friction in a base of
    dimension 1.
    """

    #: the sign of friction against the slip; −1 serves as a negative control
    against = 1

    def __init__(self, s: SceneSymbols, scene: Scene, numbers: Arithmetic) -> None:
        self.s, self.scene, self.numbers, self.n = s, scene, numbers, s.n
        self.p = [numbers.number(e) for e in scene.parameter_values]
        self.coordinates, self._place, self._phi = gap_functions(s, scene.contact, numbers)
        self._motion, self._energy = motion_functions(s, numbers)
        self.count = len(self.coordinates)
        kappa = flatten((scene.friction,))
        if isinstance(scene.friction, tuple) and len(kappa) != self.count:
            raise BadInput(
                f"{s.name}: friction has {len(kappa)} entries; give one for each gap, {self.count}."
            )
        spread = kappa if isinstance(scene.friction, tuple) else kappa * self.count
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
        #: True if ξ is affine in μ
        self.quadratic = self._legendre.quadratic

    @cached_property
    def no_impulses(self) -> np.ndarray:
        """Zero impulses, (K, 1 + D): for each gap the normal one, then those along its coordinates.

        Only gaps with friction count for D.
        """
        rough = (e for e, kappa in zip(self.coordinates, self.friction, strict=True) if kappa > 0)
        width = 1 + max((self.n if e is None else len(e) for e in rough), default=0)
        zeros: np.ndarray = self.numbers.zeros(self.count, width)
        return zeros

    def phi(self, rows: np.ndarray) -> np.ndarray:
        """Return φ at rows of x, (r, K)."""
        return np.array(np.broadcast_to(self._phi(rows.T, self.p).T, (len(rows), self.count)))

    def _made(self, x: Vector) -> list[Matrix]:
        """Return the numbers from which `at` is made.

        A distance has no slope at its centre, where it is 0/0: there everything except φ is taken
        at a point beside x, as near as round-off allows a slope.
        """
        try:
            numbers = self._place(x, self.p)
            if finite(numbers[2]).all():
                return numbers
        except ArithmeticError:
            pass
        for power in BESIDE:
            with suppress(ArithmeticError):
                away = (4 * self.numbers.eps) ** (self.numbers.number(power) / 2)
                _, *rest = self._place(x + away * (1 + abs(x)), self.p)
                if finite(rest[1]).all():
                    return [self.phi(x[None])[0], *rest]
        return self._place(x, self.p)

    def at(self, x: Vector, reach: Vector | float = 0) -> Place:
        """Return the gaps at a point; reach (K,): sizes of numbers added on the way to it."""
        phi, own_size, slope, normal, rho, own, own_slope, own_breadth = self._made(x)
        parts, first = [], 0
        for i, coordinates in enumerate(self.coordinates):
            of_gap = slice(first, first + len(coordinates or ()))
            first = of_gap.stop
            if coordinates is None and self.friction[i] > 0:
                steep, at = length(slope[i]), x[: self.n]
                plane = _plane(slope[i] / steep)
                parts.append((plane.T @ rho, plane, at, steep, abs(at).max()))
            else:
                breadth = max(own_breadth[of_gap], default=0 * phi[i])
                one = 1 + 0 * phi[i]
                parts.append((own_slope[of_gap], self._own_basis[i], own[of_gap], one, breadth))
        slip, bases, where, scale, breadths = map(list, zip(*parts, strict=True))
        size = own_size + reach
        closed = abs(phi) <= TOUCHING * self.numbers.eps * size
        return Place(x, phi, own_size, size, normal, slip, bases, where, np.array(scale), closed,
                     np.array(breadths), rho)  # fmt: skip

    def at_start(self, x: Vector) -> Place:
        """Return the gaps at a start, which is known to the round-off of its largest coordinate."""
        slope, known = self._made(x)[2], [*x[: self.n], *self.scene.x0]
        largest = max(abs(self.numbers.number(e)) for e in known)
        return self.at(x, abs(slope).sum(axis=1) * largest)

    def velocity(self, x: Vector, mu: Vector, near: Vector) -> Vector:
        """Return ξ(x, μ), (m,); `near` is a velocity nearby."""
        if self.quadratic:
            mass, offset = self._motion(x, 0 * mu, self.p)
            solved: Vector = self.numbers.solve(mass, mu - offset)
            return solved
        velocity: Vector = self._legendre(x[None], mu[None], self.p, near[None])[0]
        return velocity

    def flexibility(self, x: Vector, xi: Vector, rows: np.ndarray, push: np.ndarray) -> np.ndarray:
        """Return rows M⁻¹ pushᵀ: the change of velocities along `rows` by impulses along `push`."""
        changed: np.ndarray = rows @ self.inverse_mass(x, xi) @ push.T
        return changed

    def struck_with(self, closed: Vector, closing: Vector) -> Vector:
        """Return the closed gaps that may push if some are closing: all, as one system."""
        return closed

    def fastest(self, place: Place, xi: Vector) -> Vector:
        """Return how fast each gap could close with the kinetic energy of ξ, (K,), in any units.

        This is √(A M⁻¹Aᵀ · ξ·M ξ), which is at least |A ξ| (Cauchy and Schwarz).
        """
        return self.weights(place, xi)[1]

    def weights(self, place: Place, xi: Vector) -> tuple[Vector, Vector]:
        """Return (A M⁻¹Aᵀ of each gap: velocity change by a unit impulse, (K,); `fastest`)."""
        mass, _ = self._motion(place.x, xi, self.p)
        weight = abs((place.normal * self.numbers.solve(mass, place.normal.T).T).sum(axis=1))
        speeds: Vector = (weight * abs(xi @ mass @ xi)) ** 0.5
        return weight, speeds

    def inverse_mass(self, x: Vector, xi: Vector) -> np.ndarray:
        """Return ∂ξ/∂μ, m×m."""
        mass, _ = self._motion(x, xi, self.p)
        inverse: np.ndarray = self.numbers.solve(mass, self.numbers.identity(len(xi)))
        return inverse

    @cached_property
    def bounds(self) -> GapBounds:
        """Bounds of the gaps over boxes."""
        values = [float(e) for e in self.scene.parameter_values]
        return gap_bounds(self.s, self.scene.contact, tuple(values))

    def impulses(self, W: np.ndarray, U0: Vector, cones: Cones, start: Vector) -> Vector:
        """Return P in the cones with the velocities U₀ + W P (`cones.impulses`)."""
        return impulses(W, U0, cones, self.numbers, start)

    def energy(self, x: Vector, xi: Vector, mu: Vector) -> Number:
        """Return H at (x, ξ, μ)."""
        return self._energy(x, xi, mu, self.p)


def _plane(normal: Vector) -> np.ndarray:
    """Return an orthonormal basis of the plane across a unit vector, n×(n−1), by a reflection."""
    n, along = len(normal), normal.copy()
    along[0] += 1 if normal[0] >= 0 else -1
    one = np.eye(n, dtype=int) + 0 * normal[0]
    return (one - 2 * np.outer(along, along) / (along @ along))[:, 1:]


def gap_expressions(s: SceneSymbols, contact: GapFunction) -> tuple[Column, list[Column | None]]:
    """Return the gaps, K×1, and for each the coordinates of its plane, or None if it gives none."""
    what = "its contact"
    answer = s.evaluated(contact, what, s.position, s.parameters)
    if not _listed(answer):
        raise BadInput(
            f"{s.name}: contact= gives {shown(answer)}, but must give a list of gaps φ(x), or of "
            "(φ, [t, …]) with the coordinates along which the touching point slips."
        )
    gaps, coordinates = [], []
    for i, e in enumerate(list(answer)):
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


def _listed(value: object) -> bool:
    """Return True for a list, tuple, array or column with entries."""
    kinds = tuple, list, np.ndarray, sympy.MatrixBase
    return isinstance(value, kinds) and getattr(value, "shape", None) != () and len(value) > 0


@lru_cache(maxsize=64)
def gap_functions(
    s: SceneSymbols, contact: GapFunction, numbers: Arithmetic, columns: bool = False
) -> tuple[list[Column | None], Function, Function]:
    """Return the coordinates (`gap_expressions`) and two compiled functions.

    They give the inputs of `Gaps.at`; and φ on columns. columns: True if both work on columns.
    """
    phi, coordinates = gap_expressions(s, contact)
    own = sympy.Matrix([e for part in coordinates for e in part or ()])
    rho = natural_structure(s, s.x)[0][: s.n, :]
    slope = jacobian(phi, s.position)

    def sizes(values: Column, slopes: SymbolicMatrix) -> list[Expression]:
        """Return the size for each value's round-off: its terms and its changes with x."""
        return [
            sympy.Add(*map(abs, sympy.Add.make_args(e)), *(abs(d * x) for d, x in
                    zip(row, s.position, strict=True)))
            for e, row in zip(values, slopes.tolist(), strict=True)
        ]  # fmt: skip

    arguments = {"x": s.x, "p": s.parameter_list}
    results: list[Result] = [list(phi), sizes(phi, slope), slope, slope * rho, rho]
    own_slope = jacobian(own, s.position) if len(own) else own
    results += [list(own), own_slope * rho, sizes(own, own_slope)] if len(own) else [[], [], []]
    return (
        coordinates,
        numeric(arguments, results, numbers, columns=columns),
        numeric(arguments, [list(phi)], numbers, columns=True),
    )


@lru_cache(maxsize=64)
def motion_functions(
    s: SceneSymbols, numbers: Arithmetic, columns: bool = False
) -> tuple[Function, Function]:
    """Return functions that give M and ∂l/∂ξ; and H; columns: True if they work on columns."""
    moving = {"x": s.x, "u": s.u, "p": s.parameter_list}
    with_momentum = {"x": s.x, "u": s.u, "mu": s.mu, "p": s.parameter_list}
    return (
        numeric(moving, [mass_matrix(s), list(momentum(s))], numbers, columns=columns),
        numeric(with_momentum, [energy(s)], numbers, columns=columns),
    )


@lru_cache(maxsize=64)
def gap_bounds(s: SceneSymbols, contact: GapFunction, parameters: tuple[float, ...]) -> GapBounds:
    """Return the bounds of the gaps of a scene with the given values of its parameters."""
    phi, _ = gap_expressions(s, contact)
    known = dict(zip(s.parameter_list, parameters, strict=True))
    return GapBounds(list(s.position), list(phi), jacobian(phi, s.position), known)
