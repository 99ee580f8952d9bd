"""The exponential map, with closed forms in Stumpff functions where the algebra allows them.

dexp⁻¹ is s/(eˢ − 1) at s = ad_ξ (right-trivialised; Hairer, Lubich, Wanner, III.4), so

    R = g(ad_ξ) − ad_ξ/2,   L = g(ad_ξ) + ad_ξ/2,   g(s) = (s/2) coth(s/2) = 1 + s²/12 − …
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..algebras import MatrixAlgebra
from ..numbers.lazy import sympy
from .ad_spectrum import turnings
from .logarithm import logarithm
from .matrix_functions import DEXP, DEXP_INVERSE, DISPLACEMENT, MatrixFunction
from .retraction import Retraction
from .stumpff import stumpff


@dataclass(frozen=True)
class Exponential(Retraction):
    """exp(ξ). Its product log(exp ξ exp η) is defined while no angle reaches a half-turn.

    Closed forms: so(3), su(2), sl(2), se(2), se(3), Heisenberg's algebra and any other on which ad
    turns at one rate (`turning`), direct sums of these such as so(4). Elsewhere functions of
    matrices and their derivatives are computed from ad_ξ as numbers (`matrix_functions`).
    """

    name: str = "exponential"

    def check(self, algebra: MatrixAlgebra) -> None:
        algebra.structure_constants  # noqa: B018 - closed under brackets is all that it needs

    def displacement(self, algebra: MatrixAlgebra, xi: Any) -> Any:
        if not turnings(algebra):
            return _complex_form(algebra, MatrixFunction(DISPLACEMENT, algebra.real.basis)(xi))
        first, *others = (turning.displacement(xi) for turning in turnings(algebra))
        for other in others:  # commuting factors: (e + a)(e + b) − e
            first = first + other + first * other
        return first

    def invariant_fields(self, algebra: MatrixAlgebra, xi: Any) -> tuple[Any, Any]:
        if not turnings(algebra):
            right = MatrixFunction(DEXP_INVERSE, algebra.adjoint)(xi)
            return right + algebra.ad(xi), right
        g, half = sympy.eye(algebra.dim), algebra.ad(xi) / 2
        for turning in turnings(algebra):
            g += turning.even(xi, _coth)
        return g + half, g - half

    def inverse_left_field(self, algebra: MatrixAlgebra, xi: Any) -> Any:
        """(1 − e⁻ˢ)/s = 1 − s c₂(−s²) + s² c₃(−s²) at s = ad_ξ."""
        if not turnings(algebra):
            return MatrixFunction(DEXP, algebra.adjoint)(-xi)
        total = sympy.eye(algebra.dim)
        for turning in turnings(algebra):
            total -= turning.odd(xi, lambda z: stumpff(2, z))
            total += turning.even(xi, lambda z: stumpff(3, z))
        return total

    def lag(self, algebra: MatrixAlgebra, xi: Any, theta: Any) -> Any:
        """(e⁻ˢ − e^(−θs))/(1 − e⁻ˢ) at s = ad_ξ, as (θ − 1) + s·(odd part) + s²·(even part)."""
        parts = turnings(algebra)
        if not parts:
            return super().lag(algebra, xi, theta)
        ends, middle = theta * (1 - theta) / 2, 2 * theta - 1

        def odd(z: Any) -> Any:
            c1, before, after = (stumpff(1, z * t**2 / 4) for t in (1, theta, 1 - theta))
            return ends * before * after / c1

        def even(z: Any) -> Any:
            c1, c3, inner = (stumpff(k, z * t**2 / 4) for k, t in ((1, 1), (3, 1), (3, middle)))
            return middle * (middle**2 * inner - c3) / (8 * c1)

        total = (theta - 1) * sympy.eye(algebra.dim)
        for turning in parts:
            total += turning.odd(xi, odd) + turning.even(xi, even)
        return total

    def product(self, algebra: MatrixAlgebra, xi: Any, eta: Any) -> Any:
        return logarithm(algebra, xi, eta)


def _complex_form(algebra: MatrixAlgebra, real: Any) -> Any:
    """The N×N matrix whose real 2N×2N form is given; where the algebra is real, that itself."""
    n = algebra.size
    return real if algebra.real is algebra else real[:n, :n] + sympy.I * real[n:, :n]


def _coth(z: Any) -> Any:
    """Q with g(s) = 1 + s² Q(−s²): (c₂ − c₃)/(4c₁) at z/4, with poles at whole turns."""
    c1, c2, c3 = (stumpff(k, z / 4) for k in (1, 2, 3))
    return (c2 - c3) / (4 * c1)


exponential = Exponential()
