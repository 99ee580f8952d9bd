"""Suslov's problem: a rigid body that cannot turn about an axis fixed in it."""

from ..algebras import so
from ..groupoids import lie_group
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """½ Ω·IΩ, the axes turned so that I₁₂ = 0."""
    diagonal = sum(p.inertia[i] * v[i] ** 2 for i in range(3)) / 2
    return diagonal + p.coupling[0] * v[0] * v[2] + p.coupling[1] * v[1] * v[2]


scene = Scene(
    name="suslov",
    title="Suslov's problem",
    groupoid=lie_group(so(3)),
    parameters={"inertia": [1, 2, 3], "coupling": ["0.5", "0.3"]},
    lagrangian=lagrangian,
    nonholonomic=lambda x, p: [[0, 0, 1]],
    v0=["0.4", "-0.9", 0],
    duration=10,
    step="0.1",
    source="Bloch, Nonholonomic Mechanics and Control, 8.6; Fedorov, Zenkov, Nonlinearity 18",
)
