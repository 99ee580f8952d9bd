"""log(exp ξ exp η) in coordinates, known by its derivatives and to any number of digits.

∂/∂ξ = R(p) R(ξ)⁻¹ and ∂/∂η = L(p) L(η)⁻¹: the product's invariant fields. Nothing that runs in a
flow needs its values, so it is evaluated by mpmath only.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from ..algebras import MatrixAlgebra
from ..errors import BadInput
from ..numbers.evaluation import number
from ..numbers.lazy import sympy
from .matrix_functions import DISPLACEMENT, in_arithmetic


def logarithm(algebra: MatrixAlgebra, xi: Any, eta: Any) -> Any:
    """The m×1 coordinates of log(exp ξ exp η), as sympy functions of the entries of ξ and η."""
    if not any(xi):
        return sympy.Matrix(eta)
    if not any(eta):
        return sympy.Matrix(xi)
    make = _class(algebra)
    return sympy.Matrix([make(i, *xi, *eta) for i in range(algebra.dim)])


@lru_cache(maxsize=64)
def _class(algebra: MatrixAlgebra) -> Any:
    m = algebra.dim

    class Logarithm(sympy.Function):
        """Entry i of the product; the other arguments are ξ and η."""

        def _split(self) -> tuple[Any, Any]:
            return sympy.Matrix(self.args[1 : m + 1]), sympy.Matrix(self.args[m + 1 :])

        def _eval_is_real(self) -> bool:
            return True

        def _eval_derivative(self, s: Any) -> Any:
            xi, eta = self._split()
            d_xi, d_eta = xi.diff(s), eta.diff(s)
            if not any(d_xi) and not any(d_eta):
                return 0 * s
            columns = (c.as_immutable() for c in (xi, eta, d_xi, d_eta))
            return _slope(algebra, *columns)[self.args[0]]

        def in_arithmetic(self, numbers: Any, values: Any) -> Any:
            """The entry at given numbers."""
            return _numbers(algebra, tuple(values[1:]), numbers)[int(self.args[0])]

        def _eval_evalf(self, prec: int) -> Any:
            if not all(a.is_number for a in self.args):
                return None
            return sympy.Float._new(number(self, prec)._mpf_, prec)

    Logarithm.__name__ = f"logarithm_{algebra.name}"
    return Logarithm


@lru_cache(maxsize=4096)
def _slope(algebra: MatrixAlgebra, *columns: Any) -> Any:
    """R(p) R(ξ)⁻¹ dξ + L(p) L(η)⁻¹ dη, m×1."""
    from .exponential import exponential

    xi, eta, d_xi, d_eta = columns
    p = logarithm(algebra, xi, eta)
    left, right = exponential.invariant_fields(algebra, p)
    total = 0 * d_xi
    if any(d_xi):  # R(ξ)⁻¹ = L(−ξ)⁻¹
        total += right * (exponential.inverse_left_field(algebra, -xi) * d_xi)
    if any(d_eta):
        total += left * (exponential.inverse_left_field(algebra, eta) * d_eta)
    return sympy.ImmutableMatrix(total)


@lru_cache(maxsize=4096)
def _numbers(algebra: MatrixAlgebra, values: tuple[Any, ...], numbers: Any) -> Any:
    """The m entries at numbers ξ, η."""
    m, real = algebra.dim, algebra.real
    with numbers.working():
        factors = []
        for part in (values[:m], values[m:]):
            basis = [np.array([[numbers.number(e) for e in row] for row in b]) for b in real.basis]
            hat = sum(v * b for v, b in zip(part, basis, strict=True))
            factors.append(_eye(hat, numbers) + in_arithmetic(numbers)(hat, DISPLACEMENT))
        log = logarithm_of_matrix(factors[0] @ factors[1], numbers)
        read = [[numbers.number(e) for e in row] for row in real.dual.tolist()]
        return np.array(read) @ log.reshape(-1)


def logarithm_of_matrix(g: Any, numbers: Any) -> Any:
    """The principal logarithm of an object array: square roots until near e, then artanh's series.

    log g = 2 artanh((g − e)(g + e)⁻¹); roots by the Denman–Beavers iteration (Higham, Functions of
    Matrices, 6.3 and 11.5). Raises `BadInput` if no root is found: an angle reaches a half-turn.
    """
    one, roots = _eye(g, numbers), 0
    while _size(g - one) > 1 / 16:
        g, roots = _root(g, one, numbers), roots + 1
    y = numbers.solve(g + one, g - one)
    square = y @ y
    total, power, n = 0 * y, y, 1
    while _size(power) > numbers.eps * _size(y) / 16:
        total, power, n = total + power / n, power @ square, n + 2
    return total * 2 ** (roots + 1)


def _root(g: Any, one: Any, numbers: Any) -> Any:
    y, z = g, one
    before = None
    for _ in range(100):
        new = (y + numbers.solve(z, one)) / 2
        z = (z + numbers.solve(y, one)) / 2
        change, y = _size(new - y), new
        if change <= 8 * numbers.eps or (before is not None and before <= change < 1e-10):
            return y
        before = change
    raise BadInput(
        "log(exp ξ exp η) does not exist here: an angle reaches a half-turn; take a smaller step."
    )


def _size(matrix: Any) -> Any:
    return abs(matrix).max()


def _eye(like: Any, numbers: Any) -> Any:
    one = numbers.zeros(*like.shape)
    for i in range(len(one)):
        one[i, i] += 1
    return one
