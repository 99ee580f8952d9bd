"""A disc that rolls upright on a plane without slipping."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """x = (place on the plane, rolled angle, heading)."""
    plane = p.mass * (v[0] ** 2 + v[1] ** 2)
    return (plane + p.rolling * v[2] ** 2 + p.turning * v[3] ** 2) / 2


def _no_slip(x: Point, p: Parameters) -> list[list[Scalar]]:
    along = p.radius * sympy.cos(x[3]), p.radius * sympy.sin(x[3])
    return [[1, 0, -along[0], 0], [0, 1, -along[1], 0]]


scene = Scene(
    name="rolling-disc",
    title="Vertical rolling disc",
    groupoid=pair(4),
    parameters={"mass": 1, "radius": 1, "rolling": "0.5", "turning": "0.25"},
    lagrangian=lagrangian,
    nonholonomic=_no_slip,
    x0=[0, 0, 0, 0],
    v0=["0.8", 0, "0.8", "0.6"],
    duration=10,
    step="0.1",
    source="Bloch, Nonholonomic Mechanics and Control, 1.4",
)
