"""Kirchhoff's underwater body: an ellipsoid in an ideal fluid, on SE(3)."""

from ..algebras import se
from ..groupoids import lie_group
from ..scene import Conserved, Covector, Parameters, Point, Scalar, Scene, SymbolicMatrix, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """½ Ω·JΩ + Ω·DV + ½ V·MV, velocities in the body: v = (Ω, V)."""
    spin = sum(p.inertia[i] * v[i] ** 2 for i in range(3))
    drift = sum(p.added_mass[i] * v[3 + i] ** 2 for i in range(3))
    return (spin + drift) / 2 + p.coupling * sum(v[i] * v[3 + i] for i in range(3))


def spatial(A: SymbolicMatrix, mu: Covector, p: Parameters) -> Covector:
    """(RΠ + r × RP, RP) with the attitude A = (R, r)."""
    turn, place = A[:3, :3], A[:3, 3]
    impulse = turn * mu[3:, 0]
    return (turn * mu[:3, 0] + place.cross(impulse)).col_join(impulse)


scene = Scene(
    name="kirchhoff",
    title="Underwater body (Kirchhoff)",
    groupoid=lie_group(se(3)),
    parameters={"inertia": [1, 2, 3], "added_mass": [2, "3/2", 1], "coupling": "1/5"},
    lagrangian=lagrangian,
    v0=["0.4", "-0.3", "0.5", "0.3", "0.2", "-0.4"],
    duration=5,
    step="0.1",
    symmetries=[
        Conserved("|P|²", lambda x, mu, p: mu[3:, 0].dot(mu[3:, 0]), kind="Casimir"),
        Conserved("Π·P", lambda x, mu, p: mu[:3, 0].dot(mu[3:, 0]), kind="Casimir"),
        Conserved("spatial momentum", spatial, attitude=True),
    ],
    source="Lamb, Hydrodynamics, chapter VI; Leonard, Automatica 33 (1997)",
)
