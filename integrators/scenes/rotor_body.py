"""Rigid body with an internal rotor about its third axis, held by a torsion spring: S¹ × SO(3)."""

from ..algebras import so
from ..groupoids import lie_group, pair, product
from ..numbers import sympy
from ..scene import Conserved, Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """½ Ω·IΩ + ½ J (Ω₃ + α̇)² + k cos α, with v = (α̇, Ω)."""
    body = sum(p.inertia[i] * v[1 + i] ** 2 for i in range(3)) / 2
    return body + p.rotor * (v[3] + v[0]) ** 2 / 2 + p.spring * sympy.cos(x[0])


scene = Scene(
    name="rotor-body",
    title="Rigid body with a sprung rotor",
    groupoid=product(pair(1), lie_group(so(3))),
    parameters={"inertia": [1, 2, "5/2"], "rotor": "1/2", "spring": 1},
    lagrangian=lagrangian,
    x0=["0.5"],
    v0=["0.3", "0.7", "0.6", "0.5"],
    duration=10,
    step="0.1",
    symmetries=[Conserved("|Π|²", lambda x, mu, p: mu[1:, 0].dot(mu[1:, 0]), kind="Casimir")],
    source="Bloch, Krishnaprasad, Marsden, Sánchez de Alvarez, Automatica 28 (1992); here the "
    "torque on the rotor is a spring's",
)
