"""The Pythagorean problem: three bodies at rest at the corners of a triangle of sides 3, 4, 5."""

from itertools import combinations

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Column, Conserved, Covector, Parameters, Point, Scalar, Scene, Velocity


def _bodies(z: Column) -> list[Column]:
    """Points in the plane: the coordinates are x₁, y₁, x₂, y₂, x₃, y₃."""
    return [sympy.Matrix([z[2 * i], z[2 * i + 1]]) for i in range(3)]


def _pairs(x: Point, p: Parameters) -> list[tuple[Scalar, Scalar]]:
    """(m_i m_j, the square of the distance) of each pair."""
    bodies = combinations(zip(p.masses, _bodies(x), strict=True), 2)
    return [(m * n, (a - b).dot(a - b)) for (m, a), (n, b) in bodies]


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    kinetic = sum(m * w.dot(w) for m, w in zip(p.masses, _bodies(v), strict=True)) / 2
    return kinetic + sum(mn / sympy.sqrt(r2) for mn, r2 in _pairs(x, p))


def sigma(x: Point, mu: Covector, p: Parameters) -> Scalar:
    """(Σ r⁻³)^(−1/2), the time in which the nearest two fall together: a step is a part of it."""
    return 1 / sympy.sqrt(sum(r2 ** sympy.Rational(-3, 2) for _, r2 in _pairs(x, p)))


scene = Scene(
    name="pythagorean",
    title="Pythagorean problem of three bodies",
    groupoid=pair(6),
    parameters={"masses": [3, 4, 5]},
    lagrangian=lagrangian,
    x0=[1, 3, -2, -1, 1, -1],  # each body opposite the side of its length
    v0=[0, 0, 0, 0, 0, 0],
    sigma=sigma,
    duration=63,
    step="1/10000",
    symmetries=[
        Conserved("momentum", lambda x, mu, p: sum(_bodies(mu), sympy.zeros(2, 1))),
        Conserved("angular momentum", lambda x, mu, p: sum(
            a[0] * b[1] - a[1] * b[0] for a, b in zip(_bodies(x), _bodies(mu), strict=True)
        )),
    ],
    source="Burrau, Astron. Nachr. 195 (1913), 113; Szebehely, Peters, Astron. J. 72 (1967), 876",
)  # fmt: skip
