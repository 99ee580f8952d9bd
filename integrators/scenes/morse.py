"""Morse's oscillator: two atoms bound by D(1 − e^{−ax})²."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Parameters, Point, Scalar, Scene, Velocity


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    return p.mass * v[0] ** 2 / 2 - p.depth * (1 - sympy.exp(-p.width * x[0])) ** 2


scene = Scene(
    name="morse",
    title="Morse's oscillator",
    groupoid=pair(1),
    parameters={"mass": 1, "depth": 1, "width": "4/5"},
    lagrangian=lagrangian,
    x0=["1/2"],
    v0=["3/5"],
    duration=20,
    step="1/50",
    source="Morse, Phys. Rev. 34 (1929), 57; its motion: Slater, Nature 180 (1957), 1352",
)
