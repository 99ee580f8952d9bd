"""Double pendulum beside a wall: both masses hit it, a mass matrix that depends on the base."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Parameters, Point, Scalar, Scene
from .double_pendulum import lagrangian


def _from_the_wall(x: Point, p: Parameters) -> list[Scalar]:
    """The distances of both masses from a wall on the left, angles from the downward vertical."""
    l1, l2 = p.length
    first = l1 * sympy.sin(x[0])
    return [p.wall + first, p.wall + first + l2 * sympy.sin(x[1])]


scene = Scene(
    name="impacting-double-pendulum",
    title="Double pendulum that hits a wall",
    groupoid=pair(2),
    parameters={"mass": [1, 1], "length": [1, 1], "gravity": 1, "wall": "1/4"},
    lagrangian=lagrangian,
    contact=_from_the_wall,
    restitution="0.8",
    x0=["0.3", "0.6"],
    v0=[-1, "-1.5"],
    duration=8,
    step="0.02",
    source="Acary, Brogliato, Numerical Methods for Nonsmooth Dynamical Systems (2008)",
)
