"""Kepler's problem in the plane at eccentricity 0.6, from the pericentre."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Conserved, Covector, Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    return v.dot(v) / 2 + p.strength / sympy.sqrt(x.dot(x))


def sigma(x: Point, mu: Covector, p: Parameters) -> Scalar:
    """r^(3/2): a part of the time in which a body falls to the centre."""
    return x.dot(x) ** sympy.Rational(3, 4) / sympy.sqrt(p.strength)


scene = Scene(
    name="kepler",
    title="Kepler's problem, e = 0.6",
    groupoid=pair(2),
    parameters={"strength": 1},
    lagrangian=lagrangian,
    sigma=sigma,
    x0=["2/5", 0],  # (1 − e, 0)
    v0=[0, 2],  # (0, √((1 + e)/(1 − e)))
    duration=5,
    step="1/50",
    symmetries=[Conserved("angular momentum", lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0])],
    source="Hairer, Lubich, Wanner, Geometric Numerical Integration, I.2",
)
