"""Moser–Veselov's discrete rigid body: a discrete Lagrangian on SO(3), at any rotation a step."""

from ..algebras import so
from ..groupoids import lie_group
from ..numbers import sympy
from ..scene import Parameters, Point, Scalar, Scene, SymbolicMatrix, on_group
from .rigid_body import lagrangian
from .rigid_body import scene as rigid_body


def mass_matrix(p: Parameters) -> SymbolicMatrix:
    """Λ = ½ tr(I) e − I; positive where the strict triangle inequalities hold for I."""
    half = sum(p.inertia) / 2
    return sympy.diag(*[half - p.inertia[i] for i in range(3)])


def kinetic(x: Point, g: SymbolicMatrix, h: Scalar, p: Parameters) -> Scalar:
    """tr(Λ(e − g))/h = h ½ Ω·IΩ + O(h³) at g = exp(hΩ); hμ⁻ = gΛ − Λgᵀ, hμ⁺ = Λg − gᵀΛ."""
    mass = mass_matrix(p)
    return sum(mass[i, i] * (1 - g[i, i]) for i in range(3)) / h


def trace(x: Point, g: SymbolicMatrix, h: Scalar, p: Parameters) -> Scalar:
    """tr(gΛ): with it the map keeps the spectrum of gΛ, for tr (gΛ)² follows from |μ|."""
    mass = mass_matrix(p)
    return sum(mass[i, i] * g[i, i] for i in range(3))


scene = Scene(
    name="moser-veselov",
    title="Moser–Veselov's discrete rigid body, I = (4, 5, 6)/2",
    groupoid=lie_group(so(3)),
    parameters={"inertia": ["2", "5/2", "3"]},
    lagrangian=lagrangian,
    discrete_lagrangian=on_group(kinetic, branch=trace, kept=True, order=2),
    v0=["0.7", "0.6", "0.5"],
    duration=10,
    step="0.1",
    symmetries=rigid_body.symmetries,
    source="Moser, Veselov, Commun. Math. Phys. 139 (1991) 217–243; "
    "Marsden, Pekarsky, Shkoller, Nonlinearity 12 (1999) 1647–1662",
)
