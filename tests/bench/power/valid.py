"""Rules drawn at random that are valid: no study may say no to one.

Quadratures with straight paths (of order 1, of order 2, and symmetric), the mean of a rule and its
adjoint, gauge terms, polynomials through random nodes, and compositions with random coefficients.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from discmech.integrators.numbers import mpmath, sympy
from discmech.integrators.rules import Composition, Discretisation, Method, midpoint, trapezoidal

Nodes = list[tuple[Fraction, Fraction]]  # (θ, weight)


def random_rule(seed: int) -> Discretisation:
    """A valid rule, by its seed."""
    generator = random.Random(f"discmech valid {seed}")
    kind = list(KINDS)[seed % len(KINDS)]
    return KINDS[kind](generator, f"{kind}-{seed}")


def built_on(rule: Discretisation) -> list[Discretisation]:
    """The bench's own rules that it composes or calls."""
    formula = rule.of_step.formula
    return [own for own in (midpoint, trapezoidal)
            if formula is own.formula or own.name in formula.__code__.co_names]  # fmt: skip


def _share(generator: random.Random, low: int = 1, high: int = 19) -> Fraction:
    return Fraction(generator.randint(low, high), 20)


def _quadrature(nodes: Nodes, order: int, name: str) -> Discretisation:
    def formula(L: Any, G: Any, x: Any, u: Any, h: Any) -> Any:
        rational = [map(sympy.Rational, node) for node in nodes]
        return sum(h * w * L(G.target(x, u, c * h), u) for c, w in rational)

    written = ", ".join(f"{c} (weight {w})" for c, w in nodes)
    return Discretisation(name, formula, order, f"random nodes: {written}")


def _first(generator: random.Random, name: str) -> Discretisation:
    """Weights that sum to 1; the first moment stays away from 1/2, so the order is 1."""
    while True:
        a, b, w = _share(generator, 0, 20), _share(generator, 0, 20), _share(generator)
        if abs(w * a + (1 - w) * b - Fraction(1, 2)) > Fraction(1, 8):
            return _quadrature([(a, w), (b, 1 - w)], 1, name)


def _second(generator: random.Random, name: str) -> Discretisation:
    """Three nodes with Σw = 1 and Σwθ = 1/2."""
    while True:
        a, b, c = (_share(generator, 0, 20) for _ in range(3))
        w = _share(generator, 1, 9)
        if abs(a - b) > Fraction(1, 5):
            v = (Fraction(1, 2) - w * c - (1 - w) * b) / (a - b)
            if abs(v) < 2:
                return _quadrature([(c, w), (a, v), (b, 1 - w - v)], 2, name)


def _symmetric(generator: random.Random, name: str) -> Discretisation:
    """θ and 1 − θ with equal weights, and the middle."""
    c, w = _share(generator, 0, 9), _share(generator, 2, 10) / 2
    return _quadrature([(c, w), (1 - c, w), (Fraction(1, 2), 1 - 2 * w)], 2, name)


def _gauge(generator: random.Random, name: str) -> Discretisation:
    """L_d + c (f(b) − f(x)), c of size h²: the midpoint rule with other momenta, by O(h³)."""
    share = sympy.Rational(generator.randint(1, 19), 20)

    def formula(L: Any, G: Any, x: Any, u: Any, h: Any) -> Any:
        y = G.target(x, u, h)
        added = sum(b**2 - a**2 for a, b in zip(x, y, strict=True))
        return midpoint(L, G, x, u, h) + h**3 * share * added

    return Discretisation(name, formula, 2, "random: a total difference added")


def _polynomial(generator: random.Random, name: str) -> Discretisation:
    """Symmetric nodes θ, 1/2, 1 − θ of order 4 and a parabola: one internal stage, order 4."""
    c = sympy.Rational(generator.randint(0, 7), 20)
    w = 1 / (24 * (c - sympy.Rational(1, 2)) ** 2)

    def formula(L: Any, G: Any, x: Any, u: Any, h: Any, s: Any) -> Any:
        total = 0
        for theta, weight in ((c, w), (sympy.Rational(1, 2), 1 - 2 * w), (1 - c, w)):
            path, rate = theta * u + theta * (1 - theta) * s[0], u + (1 - 2 * theta) * s[0]
            total += h * weight * L(G.target(x, path, h), G.velocity(x, path, rate, h))
        return total

    return Discretisation(name, formula, 4, f"random: nodes {c}, 1/2, {1 - c}", 1)


def _composition(generator: random.Random, name: str) -> Discretisation:
    """a, b, c, b, a with 2a + 2b + c = 1 and 2a³ + 2b³ + c³ = 0: order 4, a at random."""
    a = Fraction(generator.randint(8, 11), 20)
    base = generator.choice([midpoint, trapezoidal])

    def halves(digits: int) -> list[Any]:
        with mpmath.workdps(digits + 10):
            first = mpmath.mpf(a.numerator) / a.denominator

            def defect(b: Any) -> Any:
                return 2 * first**3 + 2 * b**3 + (1 - 2 * first - 2 * b) ** 3

            second = mpmath.findroot(defect, mpmath.mpf(1) / 2)
            return [first, second, 1 - 2 * first - 2 * second]

    method = Method(name, 4, halves, "random: one free coefficient")
    return Composition(name, base.formula, 4, method.source, base=base, method=method)


KINDS: dict[str, Callable[[random.Random, str], Discretisation]] = {
    "first-order": _first, "second-order": _second, "symmetric": _symmetric, "gauge": _gauge,
    "polynomial": _polynomial, "composition": _composition,
}  # fmt: skip
