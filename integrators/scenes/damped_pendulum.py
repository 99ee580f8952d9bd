"""Pendulum in air: friction that grows with the speed."""

from ..groupoids import pair
from ..scene import Parameters, Point, Scalar, Scene, Velocity
from .pendulum import lagrangian


def _force(x: Point, v: Velocity, p: Parameters) -> list[Scalar]:
    return [-p.friction * v[0] - p.drag * v[0] ** 3]


scene = Scene(
    name="damped-pendulum",
    title="Pendulum with friction",
    groupoid=pair(1),
    parameters={"mass": 1, "length": 1, "gravity": 1, "friction": "0.1", "drag": "0.05"},
    lagrangian=lagrangian,
    force=_force,
    x0=[2],
    v0=["0.3"],
    duration=10,
    step="0.1",
    source="Strogatz, Nonlinear Dynamics and Chaos, 6.7; Marsden, West, Acta Numerica 2001, 3.2",
)
