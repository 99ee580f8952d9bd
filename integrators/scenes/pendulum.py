"""Mathematical pendulum in libration, let go at rest far from the bottom."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    inertia = p.mass * p.length**2
    return inertia * v[0] ** 2 / 2 + p.mass * p.gravity * p.length * sympy.cos(x[0])


scene = Scene(
    name="pendulum",
    title="Mathematical pendulum",
    groupoid=pair(1),
    parameters={"mass": 1, "length": 1, "gravity": 1},
    lagrangian=lagrangian,
    x0=[2],
    v0=[0],
    duration=10,
    step="0.1",
    source="Hairer, Lubich, Wanner, Geometric Numerical Integration, I.1",
)
