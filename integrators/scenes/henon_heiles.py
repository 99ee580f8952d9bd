"""Hénon–Heiles: two oscillators coupled by a cubic potential, in its chaotic range."""

from ..groupoids import pair
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    quadratic = (x[0] ** 2 + x[1] ** 2) / 2
    return v.dot(v) / 2 - quadratic - p.coupling * (x[0] ** 2 * x[1] - x[1] ** 3 / 3)


scene = Scene(
    name="henon-heiles",
    title="Hénon–Heiles, H ≈ 0.1247",
    groupoid=pair(2),
    parameters={"coupling": 1},
    lagrangian=lagrangian,
    x0=[0, "1/10"],
    v0=["49/100", 0],
    duration=10,
    step="0.1",
    source="Hénon, Heiles 1964; Hairer, Lubich, Wanner, Geometric Numerical Integration, I.3",
)
