"""Lagrange top: two equal moments of inertia, centre of mass on the axis of the third."""

from ..algebras import so
from ..groupoids import action
from ..scene import Conserved, Scene
from .heavy_top import SYMMETRIES, lagrangian

scene = Scene(
    name="lagrange-top",
    title="Lagrange top, nutating",
    groupoid=action(so(3)),
    parameters={"inertia": [1, 1, "1/2"], "weight": 1, "center": [0, 0, 1]},
    lagrangian=lagrangian,
    x0=["2/3", "1/3", "2/3"],
    v0=["0.1", "0.2", 3],
    duration=5,
    step="0.05",
    symmetries=[*SYMMETRIES, Conserved("μ₃", lambda x, mu, p: mu[2])],
    source="Goldstein, Poole, Safko, Classical Mechanics, 5.7",
)
