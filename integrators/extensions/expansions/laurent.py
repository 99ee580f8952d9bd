"""Sums of products of powers, for formulas that would swell as sympy's expressions.

A monomial is a product of letters and other atoms with exponents, which may be negative and halves.
What has to be inverted or rooted and is no monomial becomes an atom, and so does a function of a
sum. No common divisors are looked for; of squares one is always expressed by the others, as
x₁² = r² − x₀² and cos² = 1 − sin².
"""

from __future__ import annotations

import time
from collections.abc import Hashable
from contextlib import AbstractContextManager
from fractions import Fraction
from typing import TypeAlias

from ...errors import BadInput
from ...numbers import sympy
from ...numbers.types import Expression, Namespace, Number

Monomial = tuple[tuple[int, Fraction], ...]
#: a sum of terms, and 0 as the integer; a number for a constant one
Formula: TypeAlias = "Laurent | Number"
MOST_SECONDS = 15.0  # that formulas may take
#: a coefficient that is no exact fraction and smaller is a zero
NOTHING = 1e-40
DIGITS = 60


class TooLong(BadInput):
    """Formulas take longer than `MOST_SECONDS`."""


class Atoms:
    """The letters and other atoms of some formulas, and the kind of their coefficients.

    exact: True if all are fractions; otherwise they have 60 digits.
    """

    def __init__(self, exact: bool) -> None:
        import gmpy2

        self.exact, self._gmpy2 = exact, gmpy2
        self.expressions: list[Expression | None] = []
        self._until = time.monotonic() + MOST_SECONDS
        #: (an atom, an exponent, what that power of it is in other atoms)
        self._rules: list[tuple[int, Fraction, Laurent]] = []
        self._known: dict[Hashable, int] = {}

    def working(self) -> AbstractContextManager[object]:
        """Return the context in which the arithmetic is done."""
        return self._gmpy2.context(self._gmpy2.context(), precision=220)

    def check_time(self) -> None:
        """Raise `TooLong` if formulas have taken too long."""
        if time.monotonic() > self._until:
            raise TooLong("the formulas become too long: ask for fewer powers of the step.")

    def number(self, top: Number | Fraction, bottom: int = 1) -> Number:
        """Return top/bottom as a coefficient."""
        q = self._gmpy2.mpq(top) / bottom if isinstance(top, int | float | Fraction) else top
        return q if self.exact else self._gmpy2.mpfr(q)

    def constant(self, value: Number) -> Formula:
        """Return a number as a formula, and 0 as the integer."""
        return self.made({(): self.number(value)})

    def decimal(self, value: Expression) -> Formula:
        """Return an irrational number of sympy's as a formula."""
        return self.made({(): self._gmpy2.mpfr(str(value.evalf(DIGITS + 5)), 220)})

    def letter(self, s: Expression) -> Laurent:
        """Return a letter as a formula."""
        return Laurent(self, {((self._atom(s, s), Fraction(1)),): self.number(1)})

    def made(self, terms: dict[Monomial, Number]) -> Formula:
        """Return the sum of the terms that are not zero; 0 as the integer."""
        kept = {m: c for m, c in terms.items() if c and (self.exact or abs(c) > NOTHING)}
        for atom, power, value in self._rules:
            high = [m for m in kept if any(a == atom and e >= power for a, e in m)]
            if high:
                rest: Formula = 0
                for m in high:
                    left = Laurent(self, {_product(m, ((atom, -power),)): kept.pop(m)})
                    rest = left * value + rest
                return self.made(kept) + rest if kept else rest
        return Laurent(self, kept) if kept else 0

    def _atom(self, key: Hashable, expression: Expression | None) -> int:
        if key not in self._known:
            self._known[key] = len(self.expressions)
            self.expressions.append(expression)
        return self._known[key]

    def power(self, base: Formula, exponent: Fraction) -> Formula:
        """Return base^exponent of a formula."""
        if not isinstance(base, Laurent):
            base = Laurent(self, {(): self.number(base)})
        shared, (c, base) = self._shared(base), self._normal(base)
        if len(base.terms) == 1 and (c == 1 or exponent.denominator == 1):
            raised = tuple((a, e * exponent) for a, e in shared)
            return Laurent(self, {raised: c ** int(exponent) if c != 1 else self.number(1)})
        if exponent.denominator != 1 and any(e % 2 == 0 for _, e in shared):
            shared, base = (), base * Laurent(self, {shared: self.number(1)})  # √x² is no x
        if exponent.denominator != 1 and c != 1:
            c, base = self.number(1), base * c
        key = ("sum", frozenset(base.terms.items()))
        atom = self._atom(key, None)
        if self.expressions[atom] is None:
            self.expressions[atom] = self.written(base)
            self._rules += self._solved(atom, base)
        raised = _product(((atom, exponent),), tuple((a, e * exponent) for a, e in shared))
        return Laurent(self, {raised: c ** int(exponent) if c != 1 else self.number(1)})

    def _shared(self, base: Laurent) -> Monomial:
        """Return the monomial that all terms have as a factor."""
        parts = [dict(m) for m in base.terms]
        least = {a: min(m.get(a, Fraction(0)) for m in parts) for m in parts for a in m}
        return tuple(sorted((a, e) for a, e in least.items() if e))

    def _normal(self, base: Laurent) -> tuple[Number, Laurent]:
        """Return (c, p) of a sum c p m, m the monomial that all terms share; p begins with 1."""
        inverse = tuple((a, -e) for a, e in self._shared(base))
        c = base.terms[min(base.terms)]
        return c, Laurent(self, {_product(m, inverse): e / c for m, e in base.terms.items()})

    def function(self, name: str, argument: Formula) -> Formula:
        """Return a function of a formula as an atom; of a number, the value."""
        if not isinstance(argument, Laurent):
            value = getattr(sympy, name)(self._rational(argument))
            return self.constant(int(value)) if value.is_Integer else self.decimal(value)
        key = (name, frozenset(argument.terms.items()))
        atom = self._atom(key, None)
        if self.expressions[atom] is None:
            self.expressions[atom] = getattr(sympy, name)(self.written(argument))
            if name == "cos":
                sine = self.function("sin", argument)
                self._rules.append((atom, Fraction(2), self.number(1) - sine * sine))
        return Laurent(self, {((atom, Fraction(1)),): self.number(1)})

    def namespace(self) -> Namespace:
        """Return the functions of these coefficients, by their names in generated text."""
        names = ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log")
        own = {name: lambda e, name=name: self.function(name, e) for name in names}
        return {**own, "sqrt": lambda e: self.power(e, Fraction(1, 2))}

    # -- back to sympy ---------------------------------------------------------------------------

    def _solved(self, atom: int, base: Laurent) -> list[tuple[int, Fraction, Laurent]]:
        """Return the rule that a sum gives where one of its terms is the square of another atom."""
        for m, c in reversed(sorted(base.terms.items())):
            if len(m) == 1 and m[0][1] == 2 and not any(
                a == m[0][0] for other in base.terms if other != m for a, _ in other
            ) and not any(m[0][0] == taken for taken, *_ in self._rules):  # fmt: skip
                rest = Laurent(self, {k: e for k, e in base.terms.items() if k != m})
                own = Laurent(self, {((atom, Fraction(1)),): self.number(1)})
                return [(m[0][0], Fraction(2), (own - rest) / c)]
        return []

    def written(self, formula: Formula) -> Expression:
        """Return a formula as sympy's expression."""
        if not isinstance(formula, Laurent):
            return self._rational(formula)
        return sympy.Add(*[
            sympy.Mul(self._rational(c), *[
                sympy.Pow(self.expressions[a], sympy.Rational(e.numerator, e.denominator))
                for a, e in m
            ]) for m, c in formula.terms.items()
        ])  # fmt: skip

    def _rational(self, c: Number) -> Expression:
        if self.exact or isinstance(c, int):
            q = self._gmpy2.mpq(c)
            return sympy.Rational(int(q.numerator), int(q.denominator))
        whole = Fraction(*map(int, c.as_integer_ratio()))
        near = whole.limit_denominator(10**9)
        if abs(near - whole) <= Fraction(1, 10**30):
            return sympy.Rational(near.numerator, near.denominator)
        return sympy.Float(str(c), 16)


class Laurent:
    """A sum of terms: monomial → coefficient, none of them zero."""

    __slots__ = ("atoms", "terms")
    __array_ufunc__ = None

    def __init__(self, atoms: Atoms, terms: dict[Monomial, Number]) -> None:
        self.atoms, self.terms = atoms, terms

    def __add__(self, other: Formula) -> Formula:
        if hasattr(other, "coefficient"):  # a series, which has this among its coefficients
            return NotImplemented
        coefficients = dict(self.terms)
        terms = other.terms if isinstance(other, Laurent) else {(): self.atoms.number(other)}
        for m, c in terms.items():
            coefficients[m] = coefficients[m] + c if m in coefficients else c
        return self.atoms.made(coefficients)

    __radd__ = __add__

    def __neg__(self) -> Laurent:
        return Laurent(self.atoms, {m: -c for m, c in self.terms.items()})

    def __sub__(self, other: Formula) -> Formula:
        return self + (-other)

    def __rsub__(self, other: Formula) -> Formula:
        return -self + other

    def __mul__(self, other: Formula) -> Formula:
        if hasattr(other, "coefficient"):
            return NotImplemented
        if not isinstance(other, Laurent):
            other = self.atoms.number(other)
            return self.atoms.made({m: c * other for m, c in self.terms.items()})
        coefficients: dict[Monomial, Number] = {}
        self.atoms.check_time()
        for a, c in self.terms.items():
            for b, d in other.terms.items():
                m = _product(a, b)
                coefficients[m] = coefficients[m] + c * d if m in coefficients else c * d
        return self.atoms.made(coefficients)

    __rmul__ = __mul__

    def __truediv__(self, other: Formula) -> Formula:
        if hasattr(other, "coefficient"):
            return NotImplemented
        if not isinstance(other, Laurent):
            return self * (self.atoms.number(1) / other)
        return self * self.atoms.power(other, Fraction(-1))

    def __rtruediv__(self, other: Formula) -> Formula:
        return self.atoms.power(self, Fraction(-1)) * other

    def __pow__(self, exponent: Fraction | int) -> Formula:
        return self.atoms.power(self, Fraction(exponent))


def _product(a: Monomial, b: Monomial) -> Monomial:
    if not a or not b:
        return a or b
    exponents = dict(a)
    for atom, e in b:
        exponents[atom] = exponents.get(atom, 0) + e
    return tuple(sorted((atom, e) for atom, e in exponents.items() if e))
