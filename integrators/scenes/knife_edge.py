"""A blade on an inclined plane: it slides along its edge and turns, and does not slip across."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Conserved, Covector, Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """x = (down the slope, across it, heading); `pull` is g sin α."""
    kinetic = p.mass * (v[0] ** 2 + v[1] ** 2) + p.inertia * v[2] ** 2
    return kinetic / 2 + p.mass * p.pull * x[0]


def _along(x: Point, mu: Covector, p: Parameters) -> Scalar:
    """Along the blade, ⟨μ, (cos θ, sin θ, 0)⟩."""
    return sympy.cos(x[2]) * mu[0] + sympy.sin(x[2]) * mu[1]


scene = Scene(
    name="knife-edge",
    title="Knife edge on a slope",
    groupoid=pair(3),
    parameters={"mass": 1, "inertia": "0.5", "pull": "0.7"},
    lagrangian=lagrangian,
    nonholonomic=lambda x, p: [[sympy.sin(x[2]), -sympy.cos(x[2]), 0]],
    symmetries=[Conserved("along the blade", _along, kind="nonholonomic momentum")],
    x0=[0, 0, 0],
    v0=["0.3", 0, "0.8"],
    duration=10,
    step="0.1",
    source="Neimark, Fufaev, Dynamics of Nonholonomic Systems, III.1; Bloch, Nonholonomic "
    "Mechanics and Control, 1.6",
)
