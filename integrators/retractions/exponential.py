"""The exponential map, with closed forms in Stumpff functions where the algebra allows them.

dexp⁻¹ is s/(eˢ − 1) at s = ad_ξ (right-trivialised; Hairer, Lubich, Wanner, III.4), so

    R = g(ad_ξ) − ad_ξ/2,   L = g(ad_ξ) + ad_ξ/2,   g(s) = (s/2) coth(s/2) = 1 + s²/12 − …
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import reduce

import numpy as np

from ..algebras import MatrixAlgebra
from ..numbers import Arithmetic, LazyModule, over, registered_function, sympy
from ..numbers.types import (
    Column,
    Expression,
    FieldPair,
    Matrix,
    Number,
    Numbers,
    SymbolicMatrix,
    Vector,
)
from .ad_spectrum import turnings
from .algebra_in_numbers import AlgebraInNumbers
from .matrix_functions import DEXP, DEXP_INVERSE, DISPLACEMENT, MatrixFunction
from .retraction import EquivariantRetraction, Extents, complex_form, hat_in_doubles
from .stumpff import stumpff

linalg = LazyModule("scipy.linalg")


@dataclass(frozen=True)
class Exponential(EquivariantRetraction):
    """exp(ξ). Its product log(exp ξ exp η) is defined while no angle reaches a half-turn.

    Closed forms: so(3), su(2), sl(2), se(2), se(3), Heisenberg's algebra and any other on which ad
    turns at one rate (`ad_spectrum`), direct sums of these such as so(4). Elsewhere functions of
    matrices and their derivatives are computed from ad_ξ as numbers (`matrix_functions`).
    The chart ends where ad_ξ has the eigenvalue 2πi, for there dexp_ξ is singular. On SO(3) that is
    a whole turn; from half a turn on ξ and a shorter one about the opposite axis are one rotation,
    and ξ tells apart elements of the covering group.
    """

    name: str = "exponential"
    proven = True

    def displacement(self, algebra: MatrixAlgebra, xi: Column) -> SymbolicMatrix:
        if not turnings(algebra):
            return complex_form(algebra, MatrixFunction(DISPLACEMENT, algebra.real.basis)(xi))
        parts = (turning.displacement(xi) for turning in turnings(algebra))
        return reduce(lambda a, b: a + b + a * b, parts)  # commuting factors: (e + a)(e + b) − e

    def invariant_fields(self, algebra: MatrixAlgebra, xi: Column) -> FieldPair:
        if not turnings(algebra):
            right = MatrixFunction(DEXP_INVERSE, algebra.adjoint)(xi)
            return right + algebra.ad(xi), right
        g, half = sympy.eye(algebra.dim), algebra.ad(xi) / 2
        for turning in turnings(algebra):
            g += turning.of_ad(xi, 2, _coth)
        return g + half, g - half

    def inverse_left_field(self, algebra: MatrixAlgebra, xi: Column) -> SymbolicMatrix:
        """(1 − e⁻ˢ)/s = 1 − s c₂(−s²) + s² c₃(−s²) at s = ad_ξ."""
        if not turnings(algebra):
            return MatrixFunction(DEXP, algebra.adjoint)(-xi)
        total = sympy.eye(algebra.dim)
        for turning in turnings(algebra):
            total -= turning.of_ad(xi, 1, lambda z: stumpff(2, z))
            total += turning.of_ad(xi, 2, lambda z: stumpff(3, z))
        return total

    def lag(self, algebra: MatrixAlgebra, xi: Column, theta: Expression) -> SymbolicMatrix:
        """(e⁻ˢ − e^(−θs))/(1 − e⁻ˢ) at s = ad_ξ, as (θ − 1) + s·(odd part) + s²·(even part)."""
        parts = turnings(algebra)
        if not parts:
            return super().lag(algebra, xi, theta)
        ends, middle = theta * (1 - theta) / 2, 2 * theta - 1

        def odd(z: Expression) -> Expression:
            c1, before, after = (stumpff(1, z * t**2 / 4) for t in (1, theta, 1 - theta))
            return ends * before * after / c1

        def even(z: Expression) -> Expression:
            c1, c3, inner = (stumpff(k, z * t**2 / 4) for k, t in ((1, 1), (3, 1), (3, middle)))
            return middle * (middle**2 * inner - c3) / (8 * c1)

        total = (theta - 1) * sympy.eye(algebra.dim)
        for turning in parts:
            total += turning.of_ad(xi, 1, odd) + turning.of_ad(xi, 2, even)
        return total

    def element_in(self, frame: AlgebraInNumbers, xi: Numbers) -> Matrix:
        function, size = registered_function("matrix_function", frame.numbers), len(frame.e)
        a, *written = (frame.numbers.zeros(size, size) for _ in range(4))
        a[...] = frame.hat(xi)
        function(written[0], a, *written[1:], size, DISPLACEMENT)
        return np.asarray(frame.e + written[0])

    def coordinates_in(self, frame: AlgebraInNumbers, g: Matrix) -> Vector:
        """Coordinates of log g, m numbers; raises `ArithmeticError` where an angle reaches π.

        Square roots until near e, then log g = 2 artanh((g − e)(g + e)⁻¹) by its series (Higham,
        Functions of Matrices, 11.5). Short of a half-turn mpmath's logm takes the branch beyond
        it, and scipy's has no right digit.
        """
        e, numbers, roots = frame.e, frame.numbers, 0
        while _size(g - e) > 1 / 16:  # the series then gains two and a half digits a term
            g, roots = _root(g, e, numbers), roots + 1
        y = numbers.solve(g + e, g - e)
        square = y @ y
        total, power, n = 0 * y, y, 1
        while _size(power) > numbers.eps * _size(y) / 16:
            total, power, n = total + power / n, power @ square, n + 2
        return frame.read(total * 2 ** (roots + 1))

    def extents(self, algebra: MatrixAlgebra, xi: Column) -> Extents:
        """1 − (ϑ/2π)² for eigenvalues ±iϑ of ad_ξ.

        With closed forms ϑ is the rate of each ideal; elsewhere it is bounded by the skew part of
        ad_ξ, |ϑ|² ≤ ½‖(ad − adᵀ)/2‖²_F.
        """
        if parts := turnings(algebra):
            squares = [part.squared_rate(xi) for part in parts]
        else:
            ad = algebra.ad(xi)
            squares = [sum(e**2 for e in (ad - ad.T) / 2).expand() / 2]
        return [("rest", 1 - square / (4 * sympy.pi**2)) for square in squares]

    def reach(self, algebra: MatrixAlgebra) -> float:
        """The size at ϑ = π, 1/(1 − 1/4)², where exp ceases to be injective on SO(3)."""
        return 16 / 9

    def distance_and_margin(self, algebra: MatrixAlgebra, xi: Vector) -> tuple[float, float]:
        """2π − ϑ, ϑ the largest |Im λ| of ad_ξ, and 1 − (ϑ/2π)² (0 beyond)."""
        constants = [np.array(c.tolist(), dtype=float) for c in algebra.structure_constants]
        ad = np.array([[xi @ c[:, nu] for nu in range(algebra.dim)] for c in constants])
        turn = float(max(abs(np.linalg.eigvals(ad).imag)))
        return 2 * math.pi - turn, max(0.0, 1 - (turn / (2 * math.pi)) ** 2)

    def is_symmetric(self, algebra: MatrixAlgebra, xi: Vector) -> bool:
        """ξ is the principal logarithm of g, and g + g* > 0: on SO(3) less than a quarter turn."""
        matrix = hat_in_doubles(algebra, xi)
        if max(abs(np.linalg.eigvals(matrix).imag)) >= math.pi:
            return False
        g = linalg.expm(matrix)
        return bool(np.linalg.eigvalsh(g + g.conj().T)[0] > 0)


def _root(g: Matrix, e: Matrix, numbers: Arithmetic) -> Matrix:
    """√g by the Denman–Beavers iteration (Higham, Functions of Matrices, 6.3)."""
    y, z, before = g, e, np.inf
    for _ in range(100):  # it converges quadratically wherever there is a root
        new = (y + numbers.solve(z, e)) / 2
        z = (z + numbers.solve(y, e)) / 2
        change, y = _size(new - y), new
        if over(change, before, 8 * numbers.eps, change, change < 1e-10):
            return y
        before = change
    raise ArithmeticError("an angle reaches a half-turn")


def _size(matrix: Matrix) -> Number:
    return abs(matrix).max()


def _coth(z: Expression) -> Expression:
    """Q with g(s) = 1 + s² Q(−s²), which has poles at whole turns."""
    c1, c2, c3 = (stumpff(k, z / 4) for k in (1, 2, 3))
    return (c2 - c3) / (4 * c1)


exponential = Exponential()
