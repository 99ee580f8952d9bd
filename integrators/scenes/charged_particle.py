"""Charged particle in a uniform magnetic field: a Lagrangian with a term linear in v."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Column, Conserved, Covector, Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """½m|v|² + ½qB (x₁v₂ − x₂v₁): the symmetric gauge, B along the third axis."""
    return p.mass * v.dot(v) / 2 + p.charge * p.field * (x[0] * v[1] - x[1] * v[0]) / 2


def guiding_centre(x: Point, mu: Covector, p: Parameters) -> Column:
    """(μ₁ − ½qBx₂, μ₂ + ½qBx₁): translations change L by a total derivative only."""
    half = p.charge * p.field / 2
    return sympy.Matrix([mu[0] - half * x[1], mu[1] + half * x[0]])


scene = Scene(
    name="charged-particle",
    title="Charged particle in a uniform field",
    groupoid=pair(3),
    parameters={"mass": 1, "charge": 1, "field": 2},
    lagrangian=lagrangian,
    x0=[1, 0, 0],
    v0=["0.3", "0.5", "0.2"],
    duration=5,
    step="0.05",
    symmetries=[
        Conserved("angular momentum", lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0]),
        Conserved("axial momentum", lambda x, mu, p: mu[2]),
        Conserved("guiding centre", guiding_centre, kind="first integral"),
    ],
    source="Landau, Lifshitz, The Classical Theory of Fields, section 21",
)
