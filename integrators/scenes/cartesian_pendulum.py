"""The pendulum in Cartesian coordinates: a mass on a rod, held by a constraint."""

from ..groupoids import pair
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    return p.mass * v.dot(v) / 2 - p.mass * p.gravity * x[1]


scene = Scene(
    name="cartesian-pendulum",
    title="Pendulum, Cartesian, by a constraint",
    groupoid=pair(2),
    parameters={"mass": 1, "length": 1, "gravity": 1},
    lagrangian=lagrangian,
    holonomic=lambda x, p: [(x.dot(x) - p.length**2) / 2],
    x0=["0.96", "0.28"],
    v0=[0, 0],
    duration=10,
    step="0.05",
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, VII.1",
)
