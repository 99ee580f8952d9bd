"""A ball that bounces on the ground: times of its impacts in closed form."""

from ..groupoids import pair
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """½ v² − g x."""
    return v[0] ** 2 / 2 - p.gravity * x[0]


scene = Scene(
    name="bouncing-ball",
    title="Bouncing ball",
    groupoid=pair(1),
    parameters={"gravity": 1},
    lagrangian=lagrangian,
    contact=lambda x, p: [x[0]],
    restitution=1,
    impacts="located",
    x0=[1],
    v0=[0],
    duration=8,
    step="0.05",
    source="impacts at (2k − 1) √(2 x₀/g) for e = 1; Brogliato, Nonsmooth Mechanics, 1.2",
)
