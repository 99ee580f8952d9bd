"""Pendulum on a stiff spring: a fast radial oscillation on a slow swing."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def fast(x: Point, p: Parameters) -> Scalar:
    """The spring."""
    return p.stiffness * (sympy.sqrt(x.dot(x)) - p.length) ** 2 / 2


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    return p.mass * v.dot(v) / 2 - fast(x, p) - p.mass * p.gravity * x[1]


scene = Scene(
    name="spring-pendulum",
    title="Pendulum on a stiff spring",
    groupoid=pair(2),
    parameters={"mass": 1, "stiffness": 100, "length": 1, "gravity": 1},
    lagrangian=lagrangian,
    fast=fast,
    x0=["3/5", "-4/5"],
    v0=["1/5", 0],
    duration=4,
    step="1/50",
    source="Ascher, Reich, SIAM J. Sci. Comput. 20 (1999), 1065: highly oscillatory springs",
)
