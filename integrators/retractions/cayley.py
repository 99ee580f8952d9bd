"""The Cayley transform: rational, for algebras closed under ξηξ (paper, section 3.6.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..algebras import MatrixAlgebra
from ..errors import BadInput
from ..numbers.lazy import sympy
from .retraction import Retraction


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
        e, a = sympy.eye(algebra.size), algebra.hat(xi) / 2
        return (_inverse(e - a) * (e + a)).applyfunc(sympy.cancel)

    def displacement(self, algebra: MatrixAlgebra, xi: Any) -> Any:
        return (self.element(algebra, xi) - sympy.eye(algebra.size)).applyfunc(sympy.cancel)

    def invariant_fields(self, algebra: MatrixAlgebra, xi: Any) -> tuple[Any, Any]:
        e, a = sympy.eye(algebra.size), algebra.hat(xi) / 2
        left, right = _between(algebra, e + a, e - a), _between(algebra, e - a, e + a)
        return left.applyfunc(sympy.expand), right.applyfunc(sympy.expand)

    def inverse_left_field(self, algebra: MatrixAlgebra, xi: Any) -> Any:
        e, a = sympy.eye(algebra.size), algebra.hat(xi) / 2
        return _between(algebra, _inverse(e + a), _inverse(e - a)).applyfunc(sympy.cancel)

    def product(self, algebra: MatrixAlgebra, xi: Any, eta: Any) -> Any:
        # cay(2a) cay(2b) = cay(2c) with c = (e − a)⁻¹ (a + b) (e + ab)⁻¹ (e − a):
        # both g − e and g + e have the factors (e − a)⁻¹ and (e − b)⁻¹, which cancel.
        e, a, b = sympy.eye(algebra.size), algebra.hat(xi) / 2, algebra.hat(eta) / 2
        c = _times(_inverse(e - a), a + b, _inverse(e + _times(a, b)), e - a)
        return 2 * algebra.coordinates(c)


def _between(algebra: MatrixAlgebra, left: Any, right: Any) -> Any:
    """The m×m matrix of η ↦ left·η·right."""
    basis = [algebra.hat(row) for row in sympy.eye(algebra.dim).tolist()]
    return sympy.Matrix.hstack(*[algebra.coordinates(left * eta * right) for eta in basis])


def _times(*factors: Any) -> Any:
    """The product; of numbers multiplied out, lest complex ones become ever longer expressions."""
    product = factors[0]
    for factor in factors[1:]:
        product = product * factor
        if not product.free_symbols:
            product = product.applyfunc(lambda e: e.expand())
    return product


def _inverse(matrix: Any) -> Any:
    """Adjugate over determinant: entries stay small rational functions."""
    determinant = sympy.expand(matrix.det(method="berkowitz"))
    return matrix.adjugate(method="berkowitz").applyfunc(sympy.expand) / sympy.factor_terms(
        determinant
    )


cayley = Cayley()
