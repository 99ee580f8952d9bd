"""The product of a retraction, τ⁻¹(τ(ξ)τ(η)), by its derivatives and to any number of digits.

∂/∂ξ = R(p) R(ξ)⁻¹ and ∂/∂η = L(p) L(η)⁻¹: the product's invariant fields. Nothing that runs in a
flow needs its values, so there is no text of it for compiled kernels.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from ..algebras import MatrixAlgebra
from ..errors import BadInput
from ..numbers import Arithmetic, InArithmetic, sympy
from ..numbers.types import Column, Expression, Function, Letter, Number, Numbers, Vector
from .algebra_in_numbers import AlgebraInNumbers


def implicit_product(tau: Any, algebra: MatrixAlgebra, xi: Column, eta: Column) -> Column:
    """The m×1 coordinates of τ(ξ)τ(η), as sympy functions of the entries of ξ and η."""
    if not any(xi):
        return sympy.Matrix(eta)
    if not any(eta):
        return sympy.Matrix(xi)
    make = _class(tau, algebra)
    return sympy.Matrix([make(i, *xi, *eta) for i in range(algebra.dim)])


@lru_cache(maxsize=64)
def _class(tau: Any, algebra: MatrixAlgebra) -> Function:
    m = algebra.dim

    class Product(InArithmetic, sympy.Function):
        """Entry i of the product; the other arguments are ξ and η."""

        def _eval_derivative(self, s: Letter) -> Expression:
            xi, eta = map(sympy.ImmutableMatrix, (self.args[1 : m + 1], self.args[m + 1 :]))
            d_xi, d_eta = xi.diff(s), eta.diff(s)
            if not any(d_xi) and not any(d_eta):
                return 0 * s
            return _slope(tau, algebra, xi, eta, d_xi, d_eta)[self.args[0]]

        def in_arithmetic(self, numbers: Arithmetic, values: Numbers) -> Number:
            """The entry at given numbers."""
            return _numbers(tau, algebra, tuple(values[1:]), numbers)[int(self.args[0])]

    Product.__name__ = f"product_{tau.name}_{algebra.name}"
    return Product


@lru_cache(maxsize=4096)
def _slope(
    tau: Any, algebra: MatrixAlgebra, xi: Column, eta: Column, d_xi: Column, d_eta: Column
) -> Column:
    """R(p) R(ξ)⁻¹ dξ + L(p) L(η)⁻¹ dη, m×1."""
    left, right = tau.invariant_fields(algebra, implicit_product(tau, algebra, xi, eta))
    total = 0 * d_xi
    if any(d_xi):
        total += right * (tau.inverse_right_field(algebra, xi) * d_xi)
    if any(d_eta):
        total += left * (tau.inverse_left_field(algebra, eta) * d_eta)
    return sympy.ImmutableMatrix(total)


@lru_cache(maxsize=4096)
def _numbers(
    tau: Any, algebra: MatrixAlgebra, values: tuple[Number, ...], numbers: Arithmetic
) -> Vector:
    """The m entries at numbers ξ, η; raises `BadInput` outside the chart."""
    m, frame = algebra.dim, AlgebraInNumbers(algebra.real, numbers)
    with numbers.user_working():  # a retraction may be a user's
        first, second = (tau.element_in(frame, part) for part in (values[:m], values[m:]))
        try:
            return tau.coordinates_in(frame, first @ second)
        except (ArithmeticError, ValueError) as error:
            raise BadInput(
                f"the product τ(ξ)τ(η) lies outside the chart of {tau.name} on {algebra.name}; "
                "take smaller elements."
            ) from error
