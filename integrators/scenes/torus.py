"""A free particle on a torus of revolution; x = (the angle round the tube, that round the axis)."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Conserved, Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    distance = p.radius + p.tube * sympy.cos(x[0])
    return (p.tube**2 * v[0] ** 2 + distance**2 * v[1] ** 2) / 2


scene = Scene(
    name="torus",
    title="Geodesics of a torus",
    groupoid=pair(2),
    parameters={"radius": 2, "tube": 1},
    lagrangian=lagrangian,
    x0=["1/2", 0],
    v0=["4/5", "1/3"],
    duration=10,
    step="1/50",
    symmetries=[Conserved("Clairaut's constant", lambda x, mu, p: mu[1])],
    source="do Carmo, Differential Geometry of Curves and Surfaces, 4.4: Clairaut's relation",
)
