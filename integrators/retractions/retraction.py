"""The definition of a retraction: a chart of matrix groups around the identity, and its edge.

τ: g → G near 0 with τ(0) = e and dτ(0) = 1. In the chart (u; h) ↦ τ(hu)
    L = dτ⁻¹_{hu} ∘ Ad_{τ(hu)},    R = dτ⁻¹_{hu}      (right-trivialised; paper, section 3.6.2)
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from ..algebras import MatrixAlgebra
from ..errors import BadInput
from ..numbers import Arithmetic, InArithmetic, sympy
from ..numbers.types import (
    Column,
    Expression,
    FieldPair,
    Function,
    Letter,
    Matrix,
    Number,
    Numbers,
    SymbolicMatrix,
    Vector,
)
from .algebra_in_numbers import AlgebraInNumbers

#: distances of ξ from the chart's edge, as pairs (kind, value): see `Retraction.extents`
Extents = list[tuple[str, Expression]]


@dataclass(frozen=True)
class Retraction(ABC):
    """A chart of matrix groups around the identity; a subclass gives the formulas.

    ξ, η are sympy columns of coordinates, m×1. `has_translates`: True if the translates of the
    chart by the algebra's cover hold the group, so that bisections continue it. `proven`: True if
    the tests check every law, so that a scheme need not check the axioms again.
    """

    name: str
    has_translates = False
    proven = False

    def check(self, algebra: MatrixAlgebra) -> None:
        """Raise `BadInput` if the algebra is not closed, or not mapped into its group."""
        algebra.structure_constants  # noqa: B018 - raises

    @abstractmethod
    def displacement(self, algebra: MatrixAlgebra, xi: Column) -> SymbolicMatrix:
        """τ(ξ) − e, N×N, with the difference cancelled."""

    def element(self, algebra: MatrixAlgebra, xi: Column) -> SymbolicMatrix:
        """τ(ξ), N×N."""
        return sympy.eye(algebra.size) + self.displacement(algebra, xi)

    @abstractmethod
    def inverse(self, algebra: MatrixAlgebra, xi: Column) -> Column:
        """The coordinates (m×1) of τ(ξ)⁻¹."""

    def product(self, algebra: MatrixAlgebra, xi: Column, eta: Column) -> Column:
        """Return the coordinates (m×1) of τ(ξ)τ(η); raises `BadInput` where the chart has none.

        Without a closed form it has values and derivatives, but no text for compiled kernels.
        """
        return implicit_product(self, algebra, xi, eta)

    @abstractmethod
    def invariant_fields(self, algebra: MatrixAlgebra, xi: Column) -> FieldPair:
        """(L, R): the m×m matrices of left- and right-invariant fields at ξ = hu."""

    def inverse_left_field(self, algebra: MatrixAlgebra, xi: Column) -> SymbolicMatrix:
        """L⁻¹ at ξ, m×m: the left-trivialised tangent of τ."""
        return _inverse(self.invariant_fields(algebra, xi)[0])

    def inverse_right_field(self, algebra: MatrixAlgebra, xi: Column) -> SymbolicMatrix:
        """R⁻¹ at ξ, m×m: the right-trivialised tangent of τ."""
        return _inverse(self.invariant_fields(algebra, xi)[1])

    def lag(self, algebra: MatrixAlgebra, xi: Column, theta: Expression) -> SymbolicMatrix:
        """Return L(θξ)⁻¹ (θR(ξ) − R(θξ)), m×m: the effect of e→ on τ(θξ), left-trivialised."""
        _, right = self.invariant_fields(algebra, xi)
        _, partial = self.invariant_fields(algebra, theta * xi)
        difference = (theta * right - partial).applyfunc(lambda e: e.expand())
        return self.inverse_left_field(algebra, theta * xi) * difference

    def lead(self, algebra: MatrixAlgebra, xi: Column, theta: Expression) -> SymbolicMatrix:
        """Return L(θξ)⁻¹ (θ(L − R)(ξ) + R(θξ)), m×m: the effect of e← on τ(θξ) less that of e→."""
        left, right = self.invariant_fields(algebra, xi)
        _, partial = self.invariant_fields(algebra, theta * xi)
        return self.inverse_left_field(algebra, theta * xi) * (theta * (left - right) + partial)

    @abstractmethod
    def element_in(self, frame: AlgebraInNumbers, xi: Numbers) -> Matrix:
        """τ(ξ) as numbers, N×N."""

    @abstractmethod
    def coordinates_in(self, frame: AlgebraInNumbers, g: Matrix) -> Vector:
        """ξ with τ(ξ) = g as numbers, m; raises `ArithmeticError` where the chart has none."""

    @abstractmethod
    def extents(self, algebra: MatrixAlgebra, xi: Column) -> Extents:
        """Return the distance of ξ from the chart's edge, symbolic, as pairs (kind, value).

        "size": 1 at 0, its absolute value grows without bound towards the edge. "rest": 1 at 0, 0
        at the edge, negative beyond; 1/rest² is its size.
        """

    @abstractmethod
    def reach(self, algebra: MatrixAlgebra) -> float:
        """The size of `extents` at which a run leaves the chart if it may."""

    @abstractmethod
    def distance_and_margin(self, algebra: MatrixAlgebra, xi: Vector) -> tuple[float, float]:
        """(distance to the chart's edge, margin: 1 at 0 and 0 at the edge) in double precision."""

    def is_symmetric(self, algebra: MatrixAlgebra, xi: Vector) -> bool | None:
        """True if τ(ξ) lies in a symmetric neighbourhood of the chart (paper, Proposition 3.1).

        Such a 𝒲 ∋ e is open, holds g⁻¹ with g, and has its products in the chart. None: no such
        neighbourhood is known. With g + g* > 0 and k + k* > 0 no eigenvalue of gk is negative or 0:
        from gkv = −rv follows ⟨v, kv⟩ = −r⟨v, g⁻¹v⟩, whose real parts differ in sign.
        """
        return None


class EquivariantRetraction(Retraction):
    """A retraction that is odd, τ(−ξ) = τ(ξ)⁻¹, with τ(Ad_g ξ) = g τ(ξ) g⁻¹: so L − R = ad_ξ."""

    def inverse(self, algebra: MatrixAlgebra, xi: Column) -> Column:
        return -xi

    def inverse_right_field(self, algebra: MatrixAlgebra, xi: Column) -> SymbolicMatrix:
        return self.inverse_left_field(algebra, -xi)

    def lead(self, algebra: MatrixAlgebra, xi: Column, theta: Expression) -> SymbolicMatrix:
        """The identity: L(θξ) − R(θξ) = θ ad_ξ = θ (L(ξ) − R(ξ))."""
        return sympy.eye(algebra.dim)


def complex_form(algebra: MatrixAlgebra, real: SymbolicMatrix) -> SymbolicMatrix:
    """Return the N×N matrix with the given real 2N×2N form; for a real algebra the form itself."""
    n = algebra.size
    return real if algebra.real is algebra else real[:n, :n] + sympy.I * real[n:, :n]


def hat_in_doubles(algebra: MatrixAlgebra, xi: Vector) -> np.ndarray:
    """The N×N matrix of the coordinates ξ (m numbers), in double precision."""
    basis = np.array(algebra.basis, dtype=complex if algebra.is_complex else float)
    return np.asarray(np.tensordot(xi, basis, 1))


def _inverse(matrix: SymbolicMatrix) -> SymbolicMatrix:
    return matrix.inv(method="ADJ").applyfunc(sympy.cancel)


# The product of a retraction, τ⁻¹(τ(ξ)τ(η)), by its derivatives and to any number of digits:
# ∂/∂ξ = R(p) R(ξ)⁻¹ and ∂/∂η = L(p) L(η)⁻¹, the product's invariant fields. Nothing that runs in
# a flow needs its values, so there is no text of it for compiled kernels.


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
