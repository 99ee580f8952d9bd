"""Harmonic oscillator: the linear problem, where everything can be done by hand."""

from ..groupoids import pair
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    return p.mass * v[0] ** 2 / 2 - p.stiffness * x[0] ** 2 / 2


scene = Scene(
    name="harmonic",
    title="Harmonic oscillator",
    groupoid=pair(1),
    parameters={"mass": 1, "stiffness": 1},
    lagrangian=lagrangian,
    x0=[1],
    v0=[0],
    duration=10,
    step="0.1",
    source="Hairer, Lubich, Wanner, Geometric Numerical Integration, I.1",
)
