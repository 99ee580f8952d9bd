"""The Cayley transform: rational, for algebras closed under ξηξ (paper, section 3.6.2)."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import lru_cache, reduce
from itertools import product
from operator import mul
from typing import Any, TypeAlias

import numpy as np

from ..algebras import MatrixAlgebra
from ..errors import BadInput
from ..numbers import replaced, sympy
from ..numbers.types import Column, Expression, FieldPair, Matrix, Numbers, SymbolicMatrix, Vector
from .algebra_in_numbers import AlgebraInNumbers
from .retraction import EquivariantRetraction, Extents, complex_form, hat_in_doubles

#: sympy's matrix over a ring of polynomials (DomainMatrix)
Polynomials: TypeAlias = Any
#: one of its entries, and their ring
Polynomial: TypeAlias = Any
Ring: TypeAlias = Any


@dataclass(frozen=True)
class Cayley(EquivariantRetraction):
    """cay(ξ) = (e − ξ/2)⁻¹(e + ξ/2) (paper, section 3.6.2; Hairer, Lubich, Wanner, IV.8.3).

    L η = (e + ξ/2) η (e − ξ/2) and R η = (e − ξ/2) η (e + ξ/2) are polynomial. The chart ends where
    det(e + g) = 0, that is where det(e − ξ/2) grows without bound; its translates by a cover hold
    the group. Closed forms are computed over the polynomials in ξ, in the algebra's real form.
    """

    name: str = "cayley"
    has_translates = True
    proven = True

    def check(self, algebra: MatrixAlgebra) -> None:
        super().check(algebra)
        if not algebra.closed_under_triple_products:
            raise BadInput(
                f"the Cayley transform does not map {algebra.name} into its group (the algebra "
                "is not closed under ξηξ); use the exponential."
            )

    def displacement(self, algebra: MatrixAlgebra, xi: Column) -> SymbolicMatrix:
        return complex_form(algebra, _placed(_displacement(algebra), algebra, xi))

    def invariant_fields(self, algebra: MatrixAlgebra, xi: Column) -> FieldPair:
        minus, plus = _factors(algebra.real, xi)
        pairs = (plus, minus), (minus, plus)
        left, right = (_between(algebra, *pair).to_Matrix() / 4 for pair in pairs)
        return left, right

    def inverse_left_field(self, algebra: MatrixAlgebra, xi: Column) -> SymbolicMatrix:
        return _placed(_inverse_left(algebra), algebra, xi)

    def lag(self, algebra: MatrixAlgebra, xi: Column, theta: Expression) -> SymbolicMatrix:
        """In lowest terms, where θ is rational."""
        if not theta.is_Rational:
            return super().lag(algebra, xi, theta)
        return _placed(_lag(algebra, theta), algebra, xi)

    def product(self, algebra: MatrixAlgebra, xi: Column, eta: Column) -> Column:
        # cay(2a) cay(2b) = cay(2c) with c = (e − a)⁻¹ (a + b) (e + ab)⁻¹ (e − a):
        # both g − e and g + e have the factors (e − a)⁻¹ and (e − b)⁻¹, which cancel.
        real = algebra.real
        e, a, b = sympy.eye(real.size), real.hat(xi) / 2, real.hat(eta) / 2
        (first, over), (second, under) = (_adj_det(_over_ring(m)) for m in (e - a, e + a * b))
        if not under:
            raise BadInput(
                f"the product τ(ξ)τ(η) lies outside the Cayley chart of {algebra.name}, as that of "
                "two quarter turns about one axis does; take smaller elements, or the exponential."
            )
        inverse = _quotient(first, (over, first.domain)) * (a + b)
        inverse = inverse * _quotient(second, (under, second.domain))
        return 2 * real.coordinates(inverse * (e - a))

    def element_in(self, frame: AlgebraInNumbers, xi: Numbers) -> Matrix:
        a = frame.hat(xi) / 2
        return np.asarray(frame.numbers.solve(frame.e - a, frame.e + a))

    def coordinates_in(self, frame: AlgebraInNumbers, g: Matrix) -> Vector:
        e = frame.e
        return 2 * frame.read(frame.numbers.solve((e + g).T, (g - e).T).T)

    def extents(self, algebra: MatrixAlgebra, xi: Column) -> Extents:
        """det(e − ξ/2), which is 1/cos²(θ/2) at a rotation by θ."""
        near = sympy.eye(algebra.size) - algebra.hat(xi) / 2
        return [("size", near.det(method="berkowitz").expand())]

    def reach(self, algebra: MatrixAlgebra) -> float:
        """Twice the largest size that the best translate of a cover can have.

        Some translate has det(e + g B⁻¹) ≥ 2 (4 on SE(n), whose last diagonal entry is always 1),
        and det(e − ξ/2) det(e + τ(ξ)) = 2ᴺ. Twice: a trajectory near it then rarely changes charts.
        """
        return float(2.0**algebra.size)

    def distance_and_margin(self, algebra: MatrixAlgebra, xi: Vector) -> tuple[float, float]:
        """(smallest singular value of e + g, |det(e + g)/2ᴺ|^½ but at most 1)."""
        near = np.eye(algebra.size) - hat_in_doubles(algebra, xi) / 2  # e + g = 2 (e − ξ/2)⁻¹
        size = max(1.0, abs(np.linalg.det(near)))
        return 2 / float(np.linalg.norm(near, 2)), float(size**-0.5)

    def is_symmetric(self, algebra: MatrixAlgebra, xi: Vector) -> bool:
        """g + g* > 0, which is ‖ξ‖ < 2: on SO(3) less than a quarter turn."""
        return bool(np.linalg.norm(hat_in_doubles(algebra, xi), 2) < 2)


def _over_ring(matrix: SymbolicMatrix) -> Polynomials:
    """The matrix over the ring of polynomials that its entries lie in."""
    return sympy.polys.matrices.DomainMatrix.from_Matrix(matrix).to_dense()


def _adj_det(matrix: Polynomials) -> tuple[Polynomials, Polynomial]:
    """(adjugate, determinant) over the matrix' ring."""
    if not matrix.domain.is_EX:
        return matrix.adj_det()
    # sympy's fails over expressions, which irrational numbers next to letters lead to
    plain, ring = matrix.to_Matrix(), matrix.domain
    adjugate = matrix.from_Matrix(plain.adjugate()).convert_to(ring)
    return adjugate.to_dense(), ring.from_sympy(plain.det(method="berkowitz"))


def _factors(algebra: MatrixAlgebra, xi: Column) -> tuple[Polynomials, Polynomials]:
    """(2e − ξ̂, 2e + ξ̂): integer coefficients wherever the basis has them."""
    hat = _over_ring(algebra.hat(xi))
    twice = hat.eye(hat.shape, hat.domain).to_dense().scalarmul(hat.domain(2))
    return twice - hat, twice + hat


def _between(algebra: MatrixAlgebra, left: Polynomials, right: Polynomials) -> Polynomials:
    """The m×m matrix of η ↦ left·η·right in coordinates, over the ring of the factors.

    Only the entries of a product that are read are computed: there are few of them, and the basis
    has few entries.
    """
    real, size = algebra.real, algebra.real.size
    basis = [[(i, j, e[i, j]) for i, j in product(range(size), repeat=2) if e[i, j] != 0]
             for e in real.matrices]  # fmt: skip
    read = [[(*divmod(place, size), e) for place, e in enumerate(real.dual[k, :]) if e != 0]
            for k in range(real.dim)]  # fmt: skip
    scales = {a * b for row in read for *_, a in row for e in basis for *_, b in e}
    known, items = sympy.polys.constructor.construct_domain(sorted(scales, key=str))
    ring = left.domain.unify(right.domain).unify(known)
    scale = {a: ring.convert(b, known) for a, b in zip(sorted(scales, key=str), items, strict=True)}
    left, right = (m.convert_to(ring).to_list() for m in (left, right))
    entries = [
        [sum((scale[c * e] * left[a][i] * right[j][b]
              for a, b, c in row for i, j, e in place if left[a][i] and right[j][b]), ring.zero)
         for place in basis]
        for row in read
    ]  # fmt: skip
    return sympy.polys.matrices.DomainMatrix(entries, (real.dim, real.dim), ring)


def _quotient(numerators: Polynomials, *denominators: tuple[Polynomial, Ring]) -> SymbolicMatrix:
    """Each entry over the product of denominators, (polynomial, its ring) each, in lowest terms.

    Denominators are factored, and entries divided by their factors as often as there is no rest:
    that is faster than greatest common divisors.
    """
    ring = numerators.domain
    over = [ring.convert_from(e, own) for e, own in denominators]
    if not ring.is_PolynomialRing:
        whole = ring.to_sympy(reduce(mul, over))
        return numerators.to_Matrix().applyfunc(lambda e: sympy.cancel(e / whole))
    scale, powers = sympy.Integer(1), Counter[Polynomial]()
    for e in over:
        if not e:
            raise ZeroDivisionError("the denominator vanishes everywhere.")
        number, factors = e.factor_list()
        scale *= ring.domain.to_sympy(number)
        powers.update(dict(factors))
    names = {f: ring.to_sympy(f) for f in powers}

    def entry(e: Polynomial) -> Expression:
        below = sympy.Integer(1)
        for f, power in powers.items() if e else ():
            while power and not (parts := e.div([f]))[1]:
                e, power = parts[0][0], power - 1
            below *= names[f] ** power
        return ring.to_sympy(e) / scale / below

    return sympy.Matrix(*numerators.shape, [entry(e) for row in numerators.to_list() for e in row])


# -- closed forms in letters, derived once: without the step the ring is smaller -------------------


def _letters(algebra: MatrixAlgebra) -> Column:
    return sympy.Matrix([sympy.Symbol(f"xi{i}", real=True) for i in range(algebra.dim)])


def _placed(matrix: SymbolicMatrix, algebra: MatrixAlgebra, xi: Column) -> SymbolicMatrix:
    """A closed form at ξ; raises `ZeroDivisionError` for numbers at which it has no value."""
    swap = dict(zip(_letters(algebra), xi, strict=True))
    value = sympy.Matrix(*matrix.shape, replaced(matrix, swap))
    if not xi.free_symbols and value.has(sympy.zoo, sympy.nan):
        raise ZeroDivisionError(f"the Cayley transform of {algebra.name} has no value at {[*xi]}.")
    return value


@lru_cache(maxsize=32)
def _displacement(algebra: MatrixAlgebra) -> SymbolicMatrix:
    """cay(ξ) − e in the algebra's real form."""
    minus, plus = _factors(algebra.real, _letters(algebra))
    inverse, det = _adj_det(minus)
    return _quotient(inverse * (plus - minus), (det, inverse.domain))


@lru_cache(maxsize=32)
def _inverse_left(algebra: MatrixAlgebra) -> SymbolicMatrix:
    """L⁻¹, which takes η to (e + ξ/2)⁻¹ η (e − ξ/2)⁻¹."""
    (right, under), (left, over) = map(_adj_det, _factors(algebra.real, _letters(algebra)))
    numerators = _between(algebra, left, right)  # over a ring that may be larger
    dets = (over, left.domain), (under, right.domain)
    return _quotient(numerators.scalarmul(numerators.domain(4)), *dets)


@lru_cache(maxsize=32)
def _lag(algebra: MatrixAlgebra, theta: Expression) -> SymbolicMatrix:
    """L(θξ)⁻¹ after θR(ξ) − R(θξ), which takes η to (θ − 1)(η + θ ξηξ/4)."""
    xi = _letters(algebra)
    hat = _over_ring(algebra.real.hat(xi))
    turned = _between(algebra, hat, hat).to_Matrix() * theta / 4
    (right, under), (left, over) = map(_adj_det, _factors(algebra.real, theta * xi))
    between = _between(algebra, left, right)
    rest = _over_ring(4 * (theta - 1) * (sympy.eye(algebra.dim) + turned))
    between, rest = between.unify(rest, fmt="dense")
    return _quotient(between * rest, (over, left.domain), (under, right.domain))


cayley = Cayley()
