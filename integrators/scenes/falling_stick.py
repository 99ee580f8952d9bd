"""A stick that falls on a table: two contacts, with friction and restitution."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """x = (centre, angle): ½ (m |ẋ|² + J θ̇²) − m g y."""
    moving = p.mass * (v[0] ** 2 + v[1] ** 2) + p.inertia * v[2] ** 2
    return moving / 2 - p.mass * p.gravity * x[1]


def _ends(x: Point, p: Parameters) -> list[tuple[Scalar, list[Scalar]]]:
    """Of both ends, the height and the place along the table."""
    c, s = p.half * sympy.cos(x[2]), p.half * sympy.sin(x[2])
    return [(x[1] + s, [x[0] + c]), (x[1] - s, [x[0] - c])]


scene = Scene(
    name="falling-stick",
    title="Stick that falls on a table",
    groupoid=pair(3),
    parameters={"mass": 1, "half": 1, "inertia": "1/3", "gravity": 1},
    lagrangian=lagrangian,
    contact=_ends,
    friction="0.3",
    restitution="0.5",
    x0=[0, "1.2", "0.5"],
    v0=["0.3", 0, "0.2"],
    duration=3,
    step="0.02",
    source="Stewart, Trinkle, Int. J. Num. Meth. Eng. 39 (1996); Painlevé's rod, κ below 4/3",
)
