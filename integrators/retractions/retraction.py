"""What a retraction is: a chart of matrix groups around the identity.

τ: g → G near 0, odd: τ(ξ)τ(−ξ) = e. In the chart (u; h) ↦ τ(hu)

    L = dτ⁻¹_{hu} ∘ Ad_{τ(hu)},    R = dτ⁻¹_{hu}      (right-trivialised; paper, section 3.6.2)
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

from ..algebras import MatrixAlgebra
from ..numbers.lazy import sympy


@dataclass(frozen=True)
class Retraction(ABC):
    """A chart of matrix groups around the identity; subclasses give the formulas.

    ξ, η are sympy columns of coordinates, m×1; L − R = ad_ξ must hold (as it does for both here).
    """

    name: str

    @abstractmethod
    def check(self, algebra: MatrixAlgebra) -> None:
        """Raise `BadInput` if the retraction does not map this algebra into its group."""

    @abstractmethod
    def displacement(self, algebra: MatrixAlgebra, xi: Any) -> Any:
        """τ(ξ) − e, N×N, with the difference cancelled."""

    @abstractmethod
    def invariant_fields(self, algebra: MatrixAlgebra, xi: Any) -> tuple[Any, Any]:
        """(L, R): the m×m matrices of left- and right-invariant fields at ξ = hu."""

    @abstractmethod
    def inverse_left_field(self, algebra: MatrixAlgebra, xi: Any) -> Any:
        """L⁻¹ at ξ, m×m: the left-trivialised tangent of τ."""

    def lag(self, algebra: MatrixAlgebra, xi: Any, theta: Any) -> Any:
        """L(θξ)⁻¹ (θR(ξ) − R(θξ)), m×m: what e→ does to τ(θξ), in left trivialisation.

        e← does this and the identity more, because L(θξ) − R(θξ) = θ ad_ξ = θ (L(ξ) − R(ξ)).
        """
        _, right = self.invariant_fields(algebra, xi)
        _, partial = self.invariant_fields(algebra, theta * xi)
        difference = (theta * right - partial).applyfunc(lambda e: e.expand())
        return self.inverse_left_field(algebra, theta * xi) * difference

    @abstractmethod
    def product(self, algebra: MatrixAlgebra, xi: Any, eta: Any) -> Any:
        """The coordinates (m×1) of τ⁻¹(τ(ξ)τ(η))."""

    def element(self, algebra: MatrixAlgebra, xi: Any) -> Any:
        """τ(ξ), N×N."""
        return sympy.eye(algebra.size) + self.displacement(algebra, xi)
