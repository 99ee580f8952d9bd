"""Mathews and Lakshmanan's oscillator, whose mass 1/(1 + λx²) depends on the place."""

from ..groupoids import pair
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    return (v[0] ** 2 - p.frequency**2 * x[0] ** 2) / (1 + p.curvature * x[0] ** 2) / 2


scene = Scene(
    name="mathews-lakshmanan",
    title="Mathews and Lakshmanan's oscillator",
    groupoid=pair(1),
    parameters={"frequency": 1, "curvature": "1/2"},
    lagrangian=lagrangian,
    x0=["1/2"],
    v0=["4/5"],
    duration=20,
    step="1/50",
    source="Mathews, Lakshmanan, Quart. Appl. Math. 32 (1974), 215",
)
