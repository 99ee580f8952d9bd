"""Lotka and Volterra's system in another gauge, ϑ + df with f = log q₀ log q₁/2: half vanishes."""

from ..numbers import sympy
from ..scene import Parameters, Point, Scalar
from .lotka_volterra import scene as symmetric


def one_form(x: Point, p: Parameters) -> list[Scalar]:
    """(log q₁/q₀, 0)."""
    return [sympy.log(x[1]) / x[0], 0]


scene = symmetric.with_values(
    name="lotka-volterra-half",
    title="Lotka and Volterra's system, by half a one-form",
    one_form=one_form,
    source="GeometricProblems.jl, LotkaVolterra2dSingular",
)
