"""The lattice of Ablowitz and Ladik, with a form that is not canonical, on a ring of sites.

iψ̇ₙ + ψₙ₊₁ − 2ψₙ + ψₙ₋₁ + |ψₙ|²(ψₙ₊₁ + ψₙ₋₁) = 0 with ψ = q + ip; x = (q₁, p₁, q₂, p₂, …).
"""

from dataclasses import replace
from fractions import Fraction

from ..groupoids import pair
from ..numbers import sympy
from ..scene import Conserved, Covector, Parameters, Point, Scalar, Scene


def _sites(x: Point) -> list[tuple[Scalar, Scalar]]:
    return [(x[i], x[i + 1]) for i in range(0, len(x), 2)]


def one_form(x: Point, p: Parameters) -> list[Scalar]:
    """Of dϑ = Σ dp ∧ dq/(1 + q² + p²): each dq has the integral over p."""
    roots = [(sympy.sqrt(1 + q**2), y) for q, y in _sites(x)]
    return [e for root, y in roots for e in (sympy.atan(y / root) / root, 0)]


def hamiltonian(x: Point, p: Parameters) -> Scalar:
    """Σ log(1 + |ψₙ|²) − Re ψₙψ̄ₙ₊₁."""
    sites = _sites(x)
    coupled = sum(a * c + b * d for k, (a, b) in enumerate(sites) for c, d in [sites[k - 1]])
    return sum(sympy.log(1 + q**2 + y**2) for q, y in sites) - coupled


def norm(x: Point, mu: Covector, p: Parameters) -> Scalar:
    """Σ log(1 + |ψₙ|²), by which all phases turn alike."""
    return sum(sympy.log(1 + q**2 + y**2) for q, y in _sites(x))


scene = Scene(
    name="ablowitz-ladik",
    title="Ablowitz and Ladik's lattice",
    groupoid=pair(6),
    one_form=one_form,
    hamiltonian=hamiltonian,
    x0=["1/2", 0, "1/5", "-3/10", "-1/10", "2/5"],
    duration=10,
    step="1/20",
    symmetries=[Conserved("norm", norm, kind="first integral")],
    source="Ablowitz, Ladik, J. Math. Phys. 17 (1976), 1011",
)


def ring(sites: int) -> Scene:
    """The lattice of so many sites, from a start that has no symmetry."""
    x0 = [Fraction((-1) ** (k % 3), 2 + k % 7) for k in range(2 * sites)]
    return replace(scene, name=f"ring-{sites}", groupoid=pair(2 * sites), x0=x0, v0=[0] * len(x0))
