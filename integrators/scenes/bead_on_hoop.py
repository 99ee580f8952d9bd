"""A bead on a hoop that turns about its vertical diameter, in space: constraints that move."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Conserved, Covector, Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    return p.mass * v.dot(v) / 2 - p.mass * p.gravity * x[2]


def _on_the_hoop(x: Point, p: Parameters, t: Scalar) -> list[Scalar]:
    """On the sphere, and in the plane of the hoop."""
    plane = x[1] * sympy.cos(p.rate * t) - x[0] * sympy.sin(p.rate * t)
    return [(x.dot(x) - p.radius**2) / 2, plane]


def _moving_energy(x: Point, mu: Covector, p: Parameters) -> Scalar:
    """Jacobi's integral: the energy less the rate times the angular momentum about the axis."""
    energy = mu.dot(mu) / (2 * p.mass) + p.mass * p.gravity * x[2]
    return energy - p.rate * (x[0] * mu[1] - x[1] * mu[0])


scene = Scene(
    name="bead-on-hoop",
    title="Bead on a turning hoop, by constraints",
    groupoid=pair(3),
    parameters={"mass": 1, "radius": 1, "gravity": 1, "rate": "1.5"},
    lagrangian=lagrangian,
    holonomic=_on_the_hoop,
    x0=["0.6", 0, "-0.8"],
    v0=[0, "0.9", 0],
    duration=5,
    step="0.05",
    symmetries=(Conserved("moving energy", _moving_energy, kind="first integral"),),
    source="Marsden, Ratiu, Introduction to Mechanics and Symmetry, 2.8; Goldstein, Classical "
    "Mechanics, 2.7",
)
