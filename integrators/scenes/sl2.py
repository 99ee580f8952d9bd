"""Geodesic flow on SL(2) with a left-invariant metric: a group that is not compact."""

from ..algebras import sl
from ..groupoids import lie_group
from ..numbers import sympy
from ..scene import Conserved, Covector, Parameters, Scene, SymbolicMatrix
from .rigid_body import lagrangian


def spatial(A: SymbolicMatrix, mu: Covector, p: Parameters) -> Covector:
    """A M A⁻¹ with μ_γ = tr(M e_γ), its entries 11, 21 and 12."""
    body = sympy.Matrix([[mu[0] / 2, mu[2]], [mu[1], -mu[0] / 2]])
    turned = A * body * A.adjugate()  # det A = 1
    return sympy.Matrix([turned[0, 0], turned[1, 0], turned[0, 1]])


scene = Scene(
    name="sl2",
    title="Geodesics of SL(2)",
    groupoid=lie_group(sl(2)),
    parameters={"inertia": [1, 2, 3]},
    lagrangian=lagrangian,
    v0=["0.3", "0.5", "-0.4"],
    duration=5,
    step="0.05",
    symmetries=[
        Conserved("μ₁²/4 + μ₂μ₃", lambda x, mu, p: mu[0] ** 2 / 4 + mu[1] * mu[2], kind="Casimir"),
        Conserved("spatial momentum", spatial, attitude=True, stretch=20),
    ],
    source="Marsden, Ratiu, Introduction to Mechanics and Symmetry, 14.5",
)
