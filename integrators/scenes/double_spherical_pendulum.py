"""Two masses on rods, one below the other, in space: held by two constraints."""

from ..groupoids import pair
from ..scene import Conserved, Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    kinetic = sum(p.masses[i // 3] * v[i] ** 2 for i in range(6)) / 2
    return kinetic - p.gravity * (p.masses[0] * x[2] + p.masses[1] * x[5])


def _rods(x: Point, p: Parameters) -> list[Scalar]:
    upper, lower = x[:3, :], x[3:, :] - x[:3, :]
    return [(r.dot(r) - length**2) / 2 for r, length in zip((upper, lower), p.lengths, strict=True)]


scene = Scene(
    name="double-spherical-pendulum",
    title="Double spherical pendulum, by constraints",
    groupoid=pair(6),
    parameters={"masses": [1, 2], "lengths": [1, 1], "gravity": 1},
    lagrangian=lagrangian,
    holonomic=_rods,
    x0=["2/7", "3/7", "-6/7", "20/21", "2/21", "-32/21"],
    v0=["0.3", "-0.2", 0, "0.4", 0, 0],
    duration=5,
    step="0.02",
    symmetries=(
        Conserved(
            "angular momentum about the vertical",
            lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0] + x[3] * mu[4] - x[4] * mu[3],
        ),
    ),
    source="Marsden, Scheurle, Z. angew. Math. Phys. 44 (1993); Marsden, West 2001, 3.5",
)
