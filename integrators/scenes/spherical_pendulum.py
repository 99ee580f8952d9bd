"""Spherical pendulum on S², regularised as a spherical top that does not turn about its rod."""

from ..algebras import so
from ..groupoids import action
from ..scene import Conserved, Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """½ ml²|ω|² − mgl x₃ with ẋ = x × ω; ω along x would be free, and μ·x = 0 says it is none."""
    return p.mass * p.length**2 * v.dot(v) / 2 - p.mass * p.gravity * p.length * x[2]


scene = Scene(
    name="spherical-pendulum",
    title="Spherical pendulum",
    groupoid=action(so(3)),
    parameters={"mass": 1, "length": 1, "gravity": 1},
    lagrangian=lagrangian,
    x0=["2/3", "1/3", "-2/3"],
    v0=["0.6", "-0.2", "0.5"],
    duration=10,
    step="0.05",
    symmetries=[
        Conserved("|x|²", lambda x, mu, p: x.dot(x), kind="Casimir", value=1),
        Conserved("μ·x", lambda x, mu, p: mu.dot(x), kind="Casimir", value=0),
        Conserved("vertical angular momentum", lambda x, mu, p: mu[2]),
    ],
    source="Marsden, Ratiu, Introduction to Mechanics and Symmetry, 1.1 and 2.10; design of the "
    "regularisation: on so(3) the Lagrangian of x × ω alone is degenerate along x",
)
