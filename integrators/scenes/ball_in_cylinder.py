"""A ball that rolls inside a vertical cylinder, which turns at a rate that swings."""

from ..algebras import so
from ..groupoids import lie_group, pair, product
from ..numbers import sympy
from ..scene import Conserved, Covector, Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """x = (angle, height) of the centre, v = (their rates, the spin ω in fixed axes)."""
    spin, around = v[2:, :], (p.cylinder - p.radius) * v[0]
    kinetic = p.mass * (around**2 + v[1] ** 2) + p.inertia * spin.dot(spin)
    return kinetic / 2 - p.mass * p.gravity * x[1]


def _no_slip(x: Point, p: Parameters, t: Scalar) -> tuple[list[list[Scalar]], list[Scalar]]:
    """The point of the ball that touches moves with the wall: around, and not up or down."""
    sine, cosine, r = sympy.sin(x[0]), sympy.cos(x[0]), p.radius
    rows = [[p.cylinder - r, 0, 0, 0, r], [0, 1, r * sine, -r * cosine, 0]]
    return rows, [p.cylinder * (p.rate + p.swing * sympy.sin(t)), 0]


def _unmoved_by_the_wall(x: Point, mu: Covector, p: Parameters) -> list[Scalar]:
    """The momentum about the line of contact; and the spin about the normal, which goes up and
    down."""
    around = p.radius * mu[0] - (p.cylinder - p.radius) * mu[4]
    return [around, sympy.cos(x[0]) * mu[2] + sympy.sin(x[0]) * mu[3]]


scene = Scene(
    name="ball-in-cylinder",
    title="Ball in a turning cylinder",
    groupoid=product(pair(2), lie_group(so(3))),
    parameters={
        "mass": 1, "cylinder": "1.5", "radius": "0.5", "inertia": "0.1", "gravity": 1,
        "rate": 1, "swing": "0.3",
    },
    lagrangian=lagrangian,
    nonholonomic=_no_slip,
    x0=[0, 0],
    v0=["1.2", "0.2", "0.3", "0.4", "0.6"],
    duration=5,
    step="0.1",
    symmetries=(Conserved("beside the wall", _unmoved_by_the_wall, kind="nonholonomic momentum"),),
    source="Neimark, Fufaev, Dynamics of Nonholonomic Systems, III.2; Gualtieri, Tokieda et al., "
    "Am. J. Phys. 74 (2006); turning surfaces: Fassò, Sansonetto, J. Nonlinear Sci. 26 (2016)",
)  # fmt: skip
