"""A point mass that bounces in a wedge: integrable at some angles, chaotic at others."""

from ..groupoids import pair
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """½ |v|² − g y."""
    return v.dot(v) / 2 - p.gravity * x[1]


def _walls(x: Point, p: Parameters) -> list[Scalar]:
    """Distances from the walls, whose half angle θ has (sin θ, cos θ) = `half`; 45° integrates."""
    sine, cosine = p.half
    return [sine * x[1] - cosine * x[0], sine * x[1] + cosine * x[0]]


scene = Scene(
    name="wedge-billiard",
    title="Point mass in a wedge",
    groupoid=pair(2),
    parameters={"gravity": 1, "half": ["0.6", "0.8"]},
    lagrangian=lagrangian,
    contact=_walls,
    restitution=1,
    impacts="located",
    x0=["0.1", 1],
    v0=["0.3", 0],
    duration=10,
    step="0.05",
    source="Lehtihet, Miller, Physica D 21 (1986)",
)
