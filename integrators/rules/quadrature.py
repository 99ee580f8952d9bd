"""Gauss and Lobatto quadrature on [0, 1] and Legendre polynomials at its nodes, to any digits.

Computed, not tabulated: nodes are roots of Legendre polynomials by Newton in mpmath (Hairer,
Lubich, Wanner, II.1.3). P_j is the shifted Legendre polynomial, Q_j(θ) = ∫₀^θ P_j. Nodes lie
symmetrically, so that P_j(1 − θ) = (−1)^j P_j(θ) and Q_j(1 − θ) = −(−1)^j Q_j(θ), j ≥ 1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

from ..numbers import LazyModule, working_digits
from ..numbers.types import Mpf, Number

mpmath = LazyModule("mpmath")


@dataclass(frozen=True)
class NodeValue:
    """A number that a formula needs at one node, as a function of the number of digits.

    what: "c" for the node, "b" for its weight, "P" or "Q" for the polynomial of degree j at it.
    """

    family: str
    count: int
    node: int
    what: str
    degree: int = 0

    def __call__(self, digits: int) -> Mpf:
        """Return the number as mpf with that many certain digits."""
        with working_digits(digits + 15):
            c, b = rule(self.family, self.count, digits + 15)[self.node]
            if self.what in "cb":
                return c if self.what == "c" else b
            x, j = 2 * c - 1, self.degree
            if self.what == "P":
                return _legendre(j, x)[0]
            return (_legendre(j + 1, x)[0] - _legendre(j - 1, x)[0]) / (4 * j + 2)


@dataclass(frozen=True)
class Nodes:
    """Quadrature with `count` nodes, "gauss" or "lobatto"; called with digits: (node, weight)."""

    family: str
    count: int

    @property
    def unknown(self) -> int:
        """The number of nodes with unknown stages: those at which the curve is not given."""
        return self.count - (self.family == "lobatto")

    def __call__(self, digits: int) -> tuple[tuple[Mpf, Mpf], ...]:
        return rule(self.family, self.count, digits)


@lru_cache(maxsize=64)
def rule(family: str, count: int, digits: int) -> tuple[tuple[Mpf, Mpf], ...]:
    """Return (node, weight) in order, for "gauss" (count ≥ 1) or "lobatto" (count ≥ 2)."""
    from numpy.polynomial import Legendre  # a list of rules needs none of it

    with working_digits(digits + 10):
        if family == "gauss":
            roots = [_root(_legendre, count, x) for x in Legendre.basis(count).roots().real]
            weights = [1 / ((1 - x**2) * _legendre(count, x)[1] ** 2) for x in roots]
        else:
            n = count - 1
            extremes = Legendre.basis(n).deriv().roots().real if n > 1 else ()
            inner = [_root(_slope_of_legendre, n, x) for x in extremes]
            inner = [(a - b) / 2 for a, b in zip(inner, reversed(inner), strict=True)]
            roots = [mpmath.mpf(-1), *inner, mpmath.mpf(1)]
            weights = [1 / (n * (n + 1) * _legendre(n, x)[0] ** 2) for x in roots]
        return tuple(((1 + x) / 2, b) for x, b in zip(roots, weights, strict=True))


def _legendre(n: int, x: Mpf) -> tuple[Mpf, Mpf]:
    """Return P_n and P_n′ at x; at ±1 only P_n."""
    before, here = 0 * x, 1 + 0 * x
    for k in range(n):
        before, here = here, ((2 * k + 1) * x * here - k * before) / (k + 1)
    return here, (n * (before - x * here) / (1 - x**2) if abs(x) != 1 else None)


def _slope_of_legendre(n: int, x: Mpf) -> tuple[Mpf, Mpf]:
    """Return P_n′ and P_n″ at x, by Legendre's equation."""
    value, slope = _legendre(n, x)
    return slope, (2 * x * slope - n * (n + 1) * value) / (1 - x**2)


def _root(function: Callable[..., tuple[Mpf, Mpf]], n: int, near: Number) -> Mpf:
    """Return the root of function(n, ·) that is `near` to double precision, by Newton's method."""
    x = mpmath.mpf(near)
    for _ in range(60):
        value, slope = function(n, x)
        x -= value / slope
        if abs(value / slope) < mpmath.sqrt(mpmath.eps) / 10**3:  # the next correction is round-off
            value, slope = function(n, x)
            return x - value / slope
    raise ArithmeticError(f"no root of the polynomial of degree {n} was found near {x}")
