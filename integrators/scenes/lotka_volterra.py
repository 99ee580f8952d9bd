"""Predators and prey of Lotka and Volterra, q̇ = q₀q₁ J ∂H, by a one-form that treats both alike."""

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Parameters, Point, Scalar, Scene


def one_form(x: Point, p: Parameters) -> list[Scalar]:
    """(log q₁/q₀, −log q₀/q₁)/2, so that dϑ = dq₁ ∧ dq₀/(q₀ q₁)."""
    return [sympy.log(x[1]) / x[0] / 2, -sympy.log(x[0]) / x[1] / 2]


def hamiltonian(x: Point, p: Parameters) -> Scalar:
    """Σ aᵢ qᵢ + bᵢ log qᵢ."""
    linear = p.linear[0] * x[0] + p.linear[1] * x[1]
    return linear + p.logarithmic[0] * sympy.log(x[0]) + p.logarithmic[1] * sympy.log(x[1])


scene = Scene(
    name="lotka-volterra",
    title="Lotka and Volterra's predators and prey",
    groupoid=pair(2),
    parameters={"linear": [-1, -1], "logarithmic": [1, 2]},
    one_form=one_form,
    hamiltonian=hamiltonian,
    x0=[1, 1],
    duration=10,
    step="1/10",
    source="Kraus, arXiv:1708.07356 (2017); GeometricProblems.jl, LotkaVolterra2dSymmetric",
)
