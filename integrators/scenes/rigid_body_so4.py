"""Free rigid body in four dimensions with Manakov's metric."""

from itertools import combinations

from ..algebras import so
from ..groupoids import lie_group
from ..scene import Conserved, Covector, Parameters, Point, Scalar, Scene, SymbolicMatrix, Velocity

ALGEBRA = so(4)


def lagrangian(x: Point, v: Velocity, p: Parameters) -> Scalar:
    """½ Σ_{i<j} (λᵢ + λⱼ) ω_ij²."""
    return sum((a + b) * w**2 for (a, b), w in zip(combinations(p.mass, 2), v, strict=True)) / 2


def pfaffian(x: Point, mu: Covector, p: Parameters) -> Scalar:
    """μ₁₂μ₃₄ − μ₁₃μ₂₄ + μ₁₄μ₂₃."""
    return mu[0] * mu[5] - mu[1] * mu[4] + mu[2] * mu[3]


def manakov(x: Point, mu: Covector, p: Parameters) -> Scalar:
    """Σ (λᵢ² + λⱼ²) μ_ij², from the spectral curve det(μ̂ + sΛ² − z)."""
    pairs = zip(combinations(p.mass, 2), mu, strict=True)
    return sum((a**2 + b**2) * m**2 for (a, b), m in pairs)


def spatial(A: SymbolicMatrix, mu: Covector, p: Parameters) -> Covector:
    """A μ̂ Aᵀ, its six entries."""
    return ALGEBRA.coordinates(A * ALGEBRA.hat(mu) * A.T)


scene = Scene(
    name="rigid-body-so4",
    title="Free rigid body in R⁴ (Manakov)",
    groupoid=lie_group(ALGEBRA),
    parameters={"mass": [1, 2, 3, 4]},
    lagrangian=lagrangian,
    v0=["0.5", "-0.3", "0.4", "0.2", "0.6", "-0.1"],
    duration=5,
    step="0.1",
    symmetries=[
        Conserved("|μ|²", lambda x, mu, p: mu.dot(mu), kind="Casimir"),
        Conserved("Pf μ", pfaffian, kind="Casimir"),
        Conserved("spatial angular momentum", spatial, attitude=True),
        Conserved("Manakov's", manakov, kind="first integral"),
    ],
    source="Manakov 1976; Hairer, Lubich, Wanner, Geometric Numerical Integration, VII.5",
)
