"""A block that slides to rest on a slope by dry friction: its way in closed form."""

from ..groupoids import pair
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """½ |v|² + g (sin α x − cos α y): x down the slope, y across it, slope = (sin α, cos α)."""
    return v.dot(v) / 2 + p.gravity * (p.slope[0] * x[0] - p.slope[1] * x[1])


scene = Scene(
    name="sliding-block",
    title="Block that slides to rest on a slope",
    groupoid=pair(2),
    parameters={"gravity": 1, "slope": ["0.28", "0.96"]},
    lagrangian=lagrangian,
    contact=lambda x, p: [x[1]],
    friction="0.5",
    impacts="located",
    x0=[0, 0],
    v0=[1, 0],
    duration=7,
    step="0.05",
    source="at rest after v₀/a at v₀²/(2a), a = g (κ cos α − sin α) = 0.2",
)
