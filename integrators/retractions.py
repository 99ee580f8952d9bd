"""Retractions τ: g → G near the identity, with their trivialised tangents.

A retraction gives the chart (u; h) ↦ τ(hu) of a matrix group, odd: τ(ξ)τ(−ξ) = e. In that chart

    L = dτ⁻¹_{hu} ∘ Ad_{τ(hu)},    R = dτ⁻¹_{hu}      (right-trivialised; paper, section 3.6.2)
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

from .algebras import MatrixAlgebra
from .errors import BadInput


@dataclass(frozen=True)
class Retraction(ABC):
    """A chart of matrix groups around the identity; subclasses give the formulas."""

    name: str

    @abstractmethod
    def check(self, algebra: MatrixAlgebra) -> None:
        """Raise `BadInput` if the retraction does not map this algebra into its group."""

    @abstractmethod
    def element(self, algebra: MatrixAlgebra, xi: Any) -> Any:
        """τ(ξ), N×N."""

    @abstractmethod
    def invariant_fields(self, algebra: MatrixAlgebra, xi: Any) -> tuple[Any, Any]:
        """(L, R): the m×m matrices of left- and right-invariant fields at ξ = hu."""

    @abstractmethod
    def inverse_left_field(self, algebra: MatrixAlgebra, xi: Any) -> Any:
        """L⁻¹ at ξ, m×m: the left-trivialised tangent of τ."""

    @abstractmethod
    def product(self, algebra: MatrixAlgebra, xi: Any, eta: Any) -> Any:
        """The coordinates (m×1) of τ⁻¹(τ(ξ)τ(η))."""


@dataclass(frozen=True)
class Cayley(Retraction):
    """cay(ξ) = (e − ξ/2)⁻¹(e + ξ/2) (paper, section 3.6.2; Hairer, Lubich, Wanner, IV.8.3).

    L η = (e + ξ/2) η (e − ξ/2) and R η = (e − ξ/2) η (e + ξ/2) are polynomial.
    """

    name: str = "cayley"

    def check(self, algebra: MatrixAlgebra) -> None:
        if not algebra.closed_under_triple_products:
            raise BadInput(
                f"the Cayley transform does not map {algebra.name} into its group (the algebra "
                "is not closed under ξηξ); use the exponential."
            )

    def element(self, algebra: MatrixAlgebra, xi: Any) -> Any:
        from sympy import cancel, eye

        e, a = eye(algebra.size), algebra.hat(xi) / 2
        return (_inverse(e - a) * (e + a)).applyfunc(cancel)

    def invariant_fields(self, algebra: MatrixAlgebra, xi: Any) -> tuple[Any, Any]:
        from sympy import expand, eye

        e, a = eye(algebra.size), algebra.hat(xi) / 2
        left, right = _between(algebra, e + a, e - a), _between(algebra, e - a, e + a)
        return left.applyfunc(expand), right.applyfunc(expand)

    def inverse_left_field(self, algebra: MatrixAlgebra, xi: Any) -> Any:
        from sympy import cancel, eye

        e, a = eye(algebra.size), algebra.hat(xi) / 2
        return _between(algebra, _inverse(e + a), _inverse(e - a)).applyfunc(cancel)

    def product(self, algebra: MatrixAlgebra, xi: Any, eta: Any) -> Any:
        from sympy import eye

        # cay(2a) cay(2b) = cay(2c) with c = (e − a)⁻¹ (a + b) (e + ab)⁻¹ (e − a):
        # both g − e and g + e have the factors (e − a)⁻¹ and (e − b)⁻¹, which cancel.
        e, a, b = eye(algebra.size), algebra.hat(xi) / 2, algebra.hat(eta) / 2
        c = _inverse(e - a) * (a + b) * _inverse(e + a * b) * (e - a)
        return 2 * algebra.coordinates(c)


def _between(algebra: MatrixAlgebra, left: Any, right: Any) -> Any:
    """The m×m matrix of η ↦ left·η·right."""
    from sympy import Matrix, eye

    basis = [algebra.hat(row) for row in eye(algebra.dim).tolist()]
    return Matrix.hstack(*[algebra.coordinates(left * eta * right) for eta in basis])


def _inverse(matrix: Any) -> Any:
    """Adjugate over determinant: entries stay small rational functions."""
    from sympy import expand, factor_terms

    determinant = expand(matrix.det(method="berkowitz"))
    return matrix.adjugate(method="berkowitz").applyfunc(expand) / factor_terms(determinant)


cayley = Cayley()
