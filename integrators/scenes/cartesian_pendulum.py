"""The pendulum in Cartesian coordinates: a mass on a rod, held by a constraint."""

from typing import Any

from ..groupoids import pair
from ..scene import Scene


def lagrangian(x: Any, v: Any, p: Any) -> Any:
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
