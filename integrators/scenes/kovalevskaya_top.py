"""Kovalevskaya top: I = (2, 2, 1), centre of mass in the equator, integrable by her integral."""

from ..algebras import so
from ..groupoids import action
from ..scene import Conserved, Covector, Parameters, Point, Scalar, Scene
from .heavy_top import SYMMETRIES, lagrangian


def kovalevskaya(x: Point, mu: Covector, p: Parameters) -> Scalar:
    """|ζ|² with ζ = (Ω₁ + iΩ₂)² − wγ, γ = Γ₁ + iΓ₂, for I = (2, 2, 1): an integral of the flow."""
    a, b = mu[0] / 2, mu[1] / 2
    return (a**2 - b**2 - p.weight * x[0]) ** 2 + (2 * a * b - p.weight * x[1]) ** 2


scene = Scene(
    name="kovalevskaya-top",
    title="Kovalevskaya top",
    groupoid=action(so(3)),
    parameters={"inertia": [2, 2, 1], "weight": 1, "center": [1, 0, 0]},
    lagrangian=lagrangian,
    x0=["2/7", "3/7", "6/7"],
    v0=["0.5", "-0.4", "0.8"],
    duration=5,
    step="0.05",
    symmetries=[*SYMMETRIES, Conserved("Kovalevskaya's", kovalevskaya, kind="first integral")],
    source="Kovalevskaya 1889; Audin, Spinning Tops, I.3",
)
