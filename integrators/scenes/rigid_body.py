"""Free rigid body: the Euler equations on so(3)*, with the attitude where it is asked for."""

from ..algebras import so
from ..groupoids import lie_group
from ..scene import Conserved, Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    return sum(p.inertia[i] * v[i] ** 2 for i in range(3)) / 2


scene = Scene(
    name="rigid-body",
    title="Free rigid body, I = (1, 2, 3)",
    groupoid=lie_group(so(3)),
    parameters={"inertia": [1, 2, 3]},
    lagrangian=lagrangian,
    v0=["0.7", "0.6", "0.5"],
    duration=10,
    step="0.1",
    symmetries=[
        Conserved("|μ|²", lambda x, mu, p: mu.dot(mu), kind="Casimir"),
        Conserved("spatial angular momentum", lambda A, mu, p: A * mu, attitude=True),
    ],
    source="Marsden, Ratiu, Introduction to Mechanics and Symmetry, 15.1; "
    "Hairer, Lubich, Wanner, Geometric Numerical Integration, VII.5",
)
