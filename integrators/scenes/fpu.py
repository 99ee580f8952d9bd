"""Fermi–Pasta–Ulam chain of alternating stiff and soft springs: three fast oscillators, coupled."""

from ..groupoids import pair
from ..scene import Parameters, Point, Scalar, Scene, Velocity

HALF = 3  # stiff springs; x = (their middles, their extensions)


def fast(x: Point, p: Parameters) -> Scalar:
    """The stiff springs."""
    return p.omega**2 * sum(e**2 for e in x[HALF:]) / 2


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """Ends fixed; soft springs with a force that grows as the cube."""
    middles, extensions = [0, *x[:HALF], 0], [0, *x[HALF:], 0]
    gaps = [
        middles[i + 1] - extensions[i + 1] - middles[i] - extensions[i] for i in range(HALF + 1)
    ]
    return v.dot(v) / 2 - fast(x, p) - sum(gap**4 for gap in gaps) / 4


scene = Scene(
    name="fpu",
    title="Fermi–Pasta–Ulam chain, ω = 50",
    groupoid=pair(2 * HALF),
    parameters={"omega": 50},
    lagrangian=lagrangian,
    fast=fast,
    x0=[1, 0, 0, "1/50", 0, 0],  # (1, 0, 0, 1/ω, 0, 0)
    v0=[1, 0, 0, 1, 0, 0],
    duration=2,
    step="1/250",
    source="Hairer, Lubich, Wanner, Geometric Numerical Integration, I.5; XIII.2",
)
