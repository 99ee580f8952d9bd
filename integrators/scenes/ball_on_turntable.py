"""A ball that rolls without slipping on a turntable: its centre goes round a circle."""

from ..algebras import so
from ..groupoids import lie_group, pair, product
from ..scene import Conserved, Covector, Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """x = the centre, v = (its velocity, the spin ω in fixed axes): inertia has no direction."""
    spin = v[2:, :]
    return (p.mass * (v[0] ** 2 + v[1] ** 2) + p.inertia * spin.dot(spin)) / 2


def _no_slip(x: Point, p: Parameters) -> tuple[list[list[Scalar]], list[Scalar]]:
    """The lowest point of the ball moves with the table."""
    rows = [[1, 0, 0, -p.radius, 0], [0, 1, p.radius, 0, 0]]
    return rows, [-p.rate * x[1], p.rate * x[0]]


def _moving_energy(x: Point, mu: Covector, p: Parameters) -> Scalar:
    """The energy less the rate times the angular momentum about the table's axis."""
    spin = mu[2:, :]
    energy = (mu[0] ** 2 + mu[1] ** 2) / (2 * p.mass) + spin.dot(spin) / (2 * p.inertia)
    return energy - p.rate * (x[0] * mu[1] - x[1] * mu[0] + mu[4])


def _about_the_contact(x: Point, mu: Covector, p: Parameters) -> list[Scalar]:
    """Angular momenta about the lowest point in two directions of the table, and the spin."""
    return [mu[3] + p.radius * mu[0], mu[2] - p.radius * mu[1], mu[4]]


scene = Scene(
    name="ball-on-turntable",
    title="Ball on a turntable",
    groupoid=product(pair(2), lie_group(so(3))),
    parameters={"mass": 1, "radius": "0.5", "inertia": "0.1", "rate": 2},
    lagrangian=lagrangian,
    nonholonomic=_no_slip,
    x0=[1, 0],
    v0=["0.2", "0.3", "3.4", "0.4", "0.7"],
    duration=10,
    step="0.1",
    symmetries=(
        Conserved("moving energy", _moving_energy, kind="first integral"),
        Conserved("about the contact", _about_the_contact, kind="nonholonomic momentum"),
    ),
    source="Earnshaw 1844; Neimark, Fufaev, Dynamics of Nonholonomic Systems, III.2; moving "
    "energy: Fassò, Sansonetto, J. Nonlinear Sci. 26 (2016)",
)
