"""Duffing's oscillator: two wells, friction, and a drive."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    return v[0] ** 2 / 2 + x[0] ** 2 / 2 - p.beta * x[0] ** 4 / 4


def _force(x: Point, v: Velocity, p: Parameters, t: Scalar) -> list[Scalar]:
    return [-p.friction * v[0] + p.drive * sympy.cos(p.frequency * t)]


scene = Scene(
    name="duffing",
    title="Duffing's oscillator, damped and driven",
    groupoid=pair(1),
    parameters={"beta": 1, "friction": "0.3", "drive": "0.5", "frequency": "1.2"},
    lagrangian=lagrangian,
    force=_force,
    x0=["0.5"],
    v0=["0.2"],
    duration=10,
    step="0.1",
    source="Guckenheimer, Holmes, Nonlinear Oscillations, Dynamical Systems, 2.2",
)
