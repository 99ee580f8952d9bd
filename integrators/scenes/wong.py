"""Wong's equations: a particle in a trap and in a Yang–Mills field, on R³ × SU(2)."""

from ..algebras import su
from ..groupoids import lie_group, pair, product
from ..scene import Column, Conserved, Covector, Parameters, Point, Scalar, Scene, Velocity


def field(x: Point) -> list[list[Scalar]]:
    """The hedgehog A(x)ẋ = ½ ẋ × x, invariant if space and isospin turn together."""
    return [[0, x[2] / 2, -x[1] / 2], [-x[2] / 2, 0, x[0] / 2], [x[1] / 2, -x[0] / 2, 0]]


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """½ m|ẋ|² + ½ κ|η|² − ½ k|x|² (Kaluza–Klein), with v = (ẋ, η = ξ + A(x)ẋ)."""
    kinetic = p.mass * v[:3, 0].dot(v[:3, 0]) + p.fibre_inertia * v[3:, 0].dot(v[3:, 0])
    return (kinetic - p.stiffness * x.dot(x)) / 2


def total(x: Point, mu: Covector, p: Parameters) -> Column:
    """x × (p + Aᵀq) − q, with p = mẋ and the isospin q."""
    q = mu[3:, 0]
    return x.cross(mu[:3, 0] + x.cross(q) / 2) - q


scene = Scene(
    name="wong",
    title="Particle in a Yang-Mills field (Wong)",
    groupoid=product(pair(3), lie_group(su(2)), connection=field),
    parameters={"mass": 1, "fibre_inertia": 1, "stiffness": 1},
    lagrangian=lagrangian,
    x0=["1", "0.5", "-0.3"],
    v0=["0.2", "-0.5", "0.4", "0.6", "-0.3", "0.5"],
    duration=10,
    step="0.05",
    symmetries=[
        Conserved("|q|²", lambda x, mu, p: mu[3:, 0].dot(mu[3:, 0]), kind="Casimir"),
        Conserved("angular momentum with isospin", total),
    ],
    source="Wong, Nuovo Cimento A 65 (1970); Montgomery, Lett. Math. Phys. 8 (1984)",
)
