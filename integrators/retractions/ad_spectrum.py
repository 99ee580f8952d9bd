"""Algebras on which ad turns at one rate: closed forms in Stumpff functions.

For so(3), su(2), sl(2), se(2) and Heisenberg's algebra s(s² + z) annihilates s = ad_ξ, for se(3)
s(s² + z)², with a quadratic form z of ξ (the squared angle; negative where ad stretches). For any
q that is analytic, with Q(z) = q(−z),

    s q(s²) = s Q(z) − s(s² + z) Q′(z)          (Hermite interpolation at s² = −z)

and the last term vanishes in the first case. so(4) is a direct sum of two such algebras.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

from ..algebras import MatrixAlgebra
from ..numbers import as_one_number, random_columns, sympy
from ..numbers.types import Column, Expression, SymbolicMatrix
from .stumpff import stumpff


@dataclass(frozen=True)
class Turning:
    """One ideal of an algebra, on which ad turns at one rate.

    project: the projection on it in the coordinates of the whole algebra, m×m.
    pairs: how many pairs ±√−z the spectrum of ad has, `pairs_of_matrix` that of the matrix ξ̂.
    """

    algebra: MatrixAlgebra
    project: SymbolicMatrix
    pairs: int
    pairs_of_matrix: int

    def displacement(self, xi: Column) -> SymbolicMatrix:
        """exp(ξ) − e for ξ in the ideal, N×N, where ξ²(ξ² + z) = 0 as matrices.

        cay(2a) − e = 2(a + a²)/(1 + z_a) with a = ξ tan(θ/2)/θ, and c₃(z)(ξ³ + zξ), which is 0
        where ξ³ = −zξ. So the rotation is one however a is rounded: with cosine and sine apart,
        even over c² + s², |Γ|² drifts (Lagrange top, 10⁶ steps: 7e-13; so: 1.5e-14). At half-turns
        a only grows large, since no rounded number has the cosine 0. Where ξ stretches, by e^s at
        most, 1 + z_a cancels: the relative error is ε e^s (1e-12 at s = 10, all digits at s = 37).
        """
        own = self.own(xi)
        z = _rate(self._square(own), self.pairs_of_matrix)
        tangent = stumpff(1, z / 4) / (2 * stumpff(0, z / 4))
        turn = own.applyfunc(lambda e: as_one_number(tangent * e))
        a, square = self.algebra.hat(turn), self._square(turn)
        over = 2 / (1 + _rate(square, self.pairs_of_matrix))
        rotation = (a + square).applyfunc(lambda e: e * over)
        b = self.algebra.hat(own)
        rest = (b * self._square(own) + z * b).applyfunc(_expand)
        return rotation + rest.applyfunc(lambda e: e * stumpff(3, z)) if any(rest) else rotation

    def _square(self, xi: Column) -> SymbolicMatrix:
        a = self.algebra.hat(xi)
        return (a * a).applyfunc(_expand)

    def of_ad(
        self, xi: Column, power: int, function: Callable[[Expression], Expression]
    ) -> SymbolicMatrix:
        """sᵖ q(s²) at s = ad_ξ, p = 1 or 2, q given as the function z ↦ Q(z) = q(−z), m×m.

        sᵖ Q(z) − sᵖ(s² + z) Q′(z), entry by entry: only the polynomials are multiplied out.
        """
        s = self.algebra.ad(self.own(xi))
        square = (s * s).applyfunc(_expand)
        z, t = _rate(square, self.pairs), sympy.Dummy("z", real=True)
        first, rest = s, (s * square + z * s).applyfunc(_expand)
        if power == 2:
            first, rest = square, (s * rest).applyfunc(_expand)
        q = function(t)
        value, slope = q.xreplace({t: z}), q.diff(t).xreplace({t: z})
        return first.applyfunc(lambda e: e * value) - rest.applyfunc(lambda e: e * slope)

    def own(self, xi: Column) -> Column:
        """The part of ξ in this ideal, in the coordinates of the whole algebra."""
        # a sum gets one letter: polynomials in its terms would be long
        return (self.project * xi).applyfunc(lambda e: as_one_number(e) if e.has(sympy.Add) else e)

    def squared_rate(self, xi: Column) -> Expression:
        """ϑ² at ξ where ±iϑ are the eigenvalues of ad on this ideal (negative: ad stretches)."""
        s = self.algebra.ad(self.project * xi)
        return _rate(s * s, self.pairs)


@lru_cache(maxsize=64)
def turnings(algebra: MatrixAlgebra) -> tuple[Turning, ...]:
    """The ideals on which the algebra turns at one rate each; empty if there is no such form."""
    if whole := _turning(algebra, sympy.eye(algebra.dim)):
        return (whole,)
    parts = [part for ideal in algebra.ideals if (part := _turning(algebra, ideal))]
    return tuple(parts) if len(parts) == len(algebra.ideals) else ()


def _turning(algebra: MatrixAlgebra, project: SymbolicMatrix) -> Turning | None:
    """The ideal if its annihilating polynomials hold at two random rational points, exactly."""
    own = [project * random_columns({"xi": algebra.dim}, seed=seed)["xi"] for seed in range(2)]
    of_ad = _pairs([algebra.ad(xi) for xi in own], 1, 2)
    of_matrix = _pairs([algebra.hat(xi) for xi in own], 2, 1)
    return Turning(algebra, project, of_ad, of_matrix) if of_ad and of_matrix else None


def _pairs(matrices: list[SymbolicMatrix], at_zero: int, at_rate: int) -> int | None:
    """The number of pairs ±√−z for which sᵃ(s² + z)ᵇ, a = at_zero, b = at_rate, is 0."""
    one = sympy.eye(matrices[0].rows)
    for count in range(1, max(one.rows // 2, 1) + 1):
        rates = [_rate(m * m, count) for m in matrices]
        values = [m**at_zero * (m * m + z * one) ** at_rate for m, z in zip(matrices, rates)]  # noqa: B905
        if not any(_expand(entry) for value in values for entry in value):
            return count
    return None


def _rate(square: SymbolicMatrix, pairs: int) -> Expression:
    return _expand(-square.trace() / (2 * pairs))


def _expand(e: Expression) -> Expression:
    return e.expand(complex=True) if e.has(sympy.I) else e.expand()
