"""The retractions that are tested, and points of their charts, evaluated to 110 digits."""

from functools import cache

import numpy as np
from sympy import Matrix, Rational, eye

from discmech.integrators import BadInput, cayley, exponential
from discmech.integrators.numbers import evaluate_matrix

RETRACTIONS = {r.name: r for r in (cayley, exponential)}
#: those with τ(−ξ) = τ(ξ)⁻¹ and τ(Ad_g ξ) = g τ(ξ) g⁻¹
EQUIVARIANT = {"cayley", "exponential"}


#: not closed under ξηξ, as test_algebras shows: Cayley's transform leaves the group
OPEN = ("sl(3)", "su(3)")


def fits(retraction, algebra):
    """Whether the retraction maps the algebra into its group; of built-in ones it is known."""
    if retraction in (cayley, exponential):
        return retraction is exponential or algebra.name not in OPEN
    try:
        retraction.check(algebra)
    except BadInput:
        return False
    return True


def direction(algebra, seed):
    numbers = [Rational((7919 * (i + 3 * seed + 1)) % 1999 - 999, 1013) for i in range(algebra.dim)]
    return Matrix(algebra.dim, 1, numbers)


@cache
def turn(algebra, seed):
    """The largest angle of ad along `direction`, 0 if nothing turns."""
    ad = np.array(algebra.ad(direction(algebra, seed)).tolist(), dtype=float)
    return float(abs(np.linalg.eigvals(ad).imag).max())


def point(tau, algebra, stratum, seed=0):
    """ξ near 0, in the middle, near the edge of the chart where it is known."""
    xi, angle = direction(algebra, seed), turn(algebra, seed)
    if stratum == "near":
        return xi / 10**7
    if stratum == "edge" and tau is cayley:
        return 1000 * xi
    if stratum == "edge" and tau is exponential:  # |θ| = 2π − 1/1000
        edge = 2 * np.pi - 1e-3
        return xi * (Rational(edge / angle).limit_denominator(10**6) if angle > 1e-6 else 3)
    return xi / 2


def decimals(matrix):
    return evaluate_matrix(Matrix(matrix), 110)


def close(found, wanted, digits=40):
    """Equal to so many digits, relative to the largest entry."""
    found, wanted = Matrix(found), Matrix(wanted)
    size = 1 + max(abs(e) for e in wanted)
    return max(abs(e) for e in found - wanted) <= size / 10**digits


def element(tau, algebra, xi):
    """τ(ξ) as a real matrix of decimals."""
    return eye(algebra.real.size) + decimals(tau.displacement(algebra.real, xi))


def fields(tau, algebra, xi):
    return tuple(map(decimals, tau.invariant_fields(algebra, xi)))


def adjoint(algebra, g, inverse):
    """Ad_g as an m×m matrix."""
    real = algebra.real
    columns = [real.coordinates(g * real.hat(e) * inverse) for e in eye(real.dim).tolist()]
    return decimals(Matrix.hstack(*columns))
