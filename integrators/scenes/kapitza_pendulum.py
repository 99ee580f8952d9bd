"""Kapitza's pendulum: its pivot is shaken so fast that it stands upside down."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters, t: Scalar) -> Scalar:
    """The pivot at height a cos γt, a total derivative left out."""
    shaken = p.gravity + p.amplitude * p.frequency**2 * sympy.cos(p.frequency * t)
    return p.length**2 * v[0] ** 2 / 2 + p.length * shaken * sympy.cos(x[0])


scene = Scene(
    name="kapitza-pendulum",
    title="Kapitza's pendulum",
    groupoid=pair(1),
    parameters={"length": 1, "gravity": 1, "amplitude": "0.1", "frequency": 30},
    lagrangian=lagrangian,
    x0=[3],
    v0=[0],
    duration=5,
    step="0.005",
    source="Landau, Lifshitz, Mechanics, §30",
)
