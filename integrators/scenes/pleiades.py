"""Pleiades: seven stars of masses 1 to 7 in a plane, which pass each other closely."""

from itertools import combinations

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Column, Conserved, Covector, Parameters, Point, Scalar, Scene, Velocity


def _stars(z: Column) -> list[Column]:
    """Points in the plane; the coordinates are x₁ … x₇, y₁ … y₇."""
    return [sympy.Matrix([z[i], z[i + 7]]) for i in range(7)]


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    kinetic = sum(m * w.dot(w) for m, w in zip(p.masses, _stars(v), strict=True)) / 2
    pairs = combinations(zip(p.masses, _stars(x), strict=True), 2)
    return kinetic + sum(m * n / sympy.sqrt((a - b).dot(a - b)) for (m, a), (n, b) in pairs)


def _spin(x: Point, mu: Covector, p: Parameters) -> Scalar:
    return sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(_stars(x), _stars(mu), strict=True))


total = Conserved("momentum", lambda x, mu, p: sum(_stars(mu), sympy.zeros(2, 1)))
scene = Scene(
    name="pleiades",
    title="Pleiades",
    groupoid=pair(14),
    parameters={"masses": range(1, 8)},
    lagrangian=lagrangian,
    x0=[3, 3, -1, -3, 2, -2, 2, 3, -3, 2, 0, 0, -4, 4],
    v0=[0, 0, 0, 0, 0, "1.75", "-1.5", 0, 0, 0, "-1.25", 1, 0, 0],
    duration=1,
    step="1/2000",
    symmetries=[total, Conserved("angular momentum", _spin)],
    source="Hairer, Nørsett, Wanner, Solving ODEs I, II.10; IVP test set 2.4, problem plei",
)
