"""Chaplygin's sleigh: a platform on a blade that does not slip sideways, in the body's axes."""

from ..algebras import se
from ..groupoids import lie_group
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """v = (turning, along the blade, across it); the centre of mass lies `ahead` of the blade."""
    across = v[2] + p.ahead * v[0]
    return (p.inertia * v[0] ** 2 + p.mass * (v[1] ** 2 + across**2)) / 2


scene = Scene(
    name="chaplygin-sleigh",
    title="Chaplygin's sleigh",
    groupoid=lie_group(se(2)),
    parameters={"inertia": 1, "mass": 1, "ahead": "0.5"},
    lagrangian=lagrangian,
    nonholonomic=lambda x, p: [[0, 0, 1]],
    v0=["1.5", "-0.4", 0],
    duration=10,
    step="0.1",
    source="Bloch, Nonholonomic Mechanics and Control, 1.7; Neimark, Fufaev, Dynamics of "
    "Nonholonomic Systems, II.6",
)
