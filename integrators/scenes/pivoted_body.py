"""A rigid body in space, held at one point of it by a constraint: the heavy top unreduced."""

from ..algebras import so
from ..groupoids import RowAction, pair, product
from ..numbers import sympy
from ..retractions import cayley
from ..scene import Conserved, Covector, Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """x = (centre of mass, attitude A row by row), v = (its velocity, the body's turning Ω)."""
    moving = p.mass * sum(v[i] ** 2 for i in range(3))
    turning = sum(p.inertia[i] * v[3 + i] ** 2 for i in range(3))
    return (moving + turning) / 2 - p.mass * p.gravity * x[2]


def _held(x: Point, p: Parameters) -> list[Scalar]:
    """The centre of mass lies at A·arm, so the origin is fixed in the body."""
    attitude = sympy.Matrix(3, 3, list(x[3:, :]))
    return list(x[:3, :] - attitude * p.arm)


def _about_the_vertical(x: Point, mu: Covector, p: Parameters) -> Scalar:
    """Of the centre of mass and of the body about it."""
    spin = x[9] * mu[3] + x[10] * mu[4] + x[11] * mu[5]
    return x[0] * mu[1] - x[1] * mu[0] + spin


scene = Scene(
    name="pivoted-body",
    title="Rigid body with a fixed point, by a constraint",
    groupoid=product(pair(3), RowAction(so(3), cayley, rows=3)),
    parameters={"mass": 1, "inertia": ["0.5", "0.7", "0.4"], "arm": [0, 0, "0.6"], "gravity": 1},
    lagrangian=lagrangian,
    holonomic=_held,
    x0=["0.36", 0, "0.48", "0.8", 0, "0.6", 0, 1, 0, "-0.6", 0, "0.8"],
    v0=["0.144", "-0.12", "-0.108", "0.2", "0.3", "1.5"],
    duration=3,
    step="0.03",
    symmetries=(Conserved("angular momentum about the vertical", _about_the_vertical),),
    source="Marsden, West 2001, 3.5; the reduced motion is that of heavy-top",
)
