"""Kepler's problem at e = 0.6 in polar form: R⁺ × S¹ reduced by rotations to pair × group."""

from ..algebras import so
from ..groupoids import lie_group, pair, product
from ..scene import Conserved, Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """½ (ṙ² + r²ω²) + k/r, with x = r and v = (ṙ, ω)."""
    return (v[0] ** 2 + x[0] ** 2 * v[1] ** 2) / 2 + p.strength / x[0]


scene = Scene(
    name="reduced-kepler",
    title="Kepler's problem, reduced by rotations",
    groupoid=product(pair(1), lie_group(so(2))),
    parameters={"strength": 1},
    lagrangian=lagrangian,
    x0=["2/5"],  # 1 − e
    v0=[0, 5],  # ω = √((1 + e)/(1 − e))/(1 − e)
    duration=5,
    step="1/50",
    symmetries=[Conserved("angular momentum", lambda x, mu, p: mu[1])],
    source="Goldstein, Poole, Safko, Classical Mechanics, 3.2; paper, last remark of section 3",
)
