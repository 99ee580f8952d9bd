"""Heavy top in generic position: an unsymmetric body whose centre of mass is on no axis."""

from ..algebras import so
from ..groupoids import action
from ..scene import Conserved, Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """½ Ω·IΩ − mgd Γ·e; Γ points up, seen from the body."""
    kinetic = sum(p.inertia[i] * v[i] ** 2 for i in range(3)) / 2
    return kinetic - p.weight * x.dot(p.center)


SYMMETRIES = (
    Conserved("μ·Γ", lambda x, mu, p: mu.dot(x), kind="Casimir"),
    Conserved("|Γ|²", lambda x, mu, p: x.dot(x), kind="Casimir", value=1),
)

scene = Scene(
    name="heavy-top",
    title="Heavy top, generic",
    groupoid=action(so(3)),
    parameters={"inertia": [1, 2, 3], "weight": 1, "center": ["2/3", "1/3", "2/3"]},
    lagrangian=lagrangian,
    x0=["2/7", "3/7", "6/7"],
    v0=["0.5", "-0.4", "0.8"],
    duration=5,
    step="0.05",
    symmetries=SYMMETRIES,
    source="paper, section 3.7 (heavy top)",
)
