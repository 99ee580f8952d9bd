"""Sums of products of powers, for formulas that would swell as sympy's expressions.

A monomial is a product of letters and other atoms with exponents, which may be negative and halves.
What has to be inverted or rooted and is no monomial becomes an atom, and so does a function of a
sum. No common divisors are looked for; a square or function in a sum that is an atom is expressed
by the rest, as x₁² = r² − x₀², cos² = 1 − sin², and with A = 2 + cos, cos = A − 2 and
sin² = 1 − (A − 2)². So powers of A, which is divided by, do not stand beside powers of its parts.
"""

from __future__ import annotations

import random
import time
from collections import Counter
from collections.abc import Hashable, Iterator
from contextlib import AbstractContextManager
from fractions import Fraction
from typing import Any, TypeAlias

from ...errors import BadInput
from ...numbers import sympy
from ...numbers.types import Expression, Namespace, Number

Exponent: TypeAlias = "int | Fraction"  # whole ones are int, whose arithmetic is fast
Monomial = tuple[tuple[int, Exponent], ...]
#: a sum of terms, and 0 as the integer; a number for a constant one
Formula: TypeAlias = "Laurent | Number"
#: atom: (exponent, what that power of it is in other atoms)
Rules: TypeAlias = "dict[int, tuple[int, Formula]]"
MOST_SECONDS = 15.0  # that formulas may take
#: a coefficient that is no exact fraction and smaller is a zero
NOTHING = 1e-40
DIGITS = 60
#: a formula vanishes if it does, next to its largest term, at so many random points; one that is
#: not 0 does so on a set of measure 0 alone
POINTS = 3


class TooLong(BadInput):
    """Formulas take longer than `MOST_SECONDS`."""


class Atoms:
    """The letters and other atoms of some formulas, and the kind of their coefficients.

    exact: True if all are fractions; otherwise they have 60 digits.
    """

    def __init__(self, exact: bool) -> None:
        import gmpy2

        self.exact, self._gmpy2 = exact, gmpy2
        self.expressions: list[Any] = []  # of sympy's; None while an atom is made
        self._until = time.monotonic() + MOST_SECONDS
        self._rules: Rules = {}
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
        return Laurent(self, {((self._atom(s, s), 1),): self.number(1)})

    def made(self, terms: dict[Monomial, Number]) -> Formula:
        """Return the sum of the terms that are not zero; 0 as the integer."""
        rules, kept = self._rules, terms
        while True:
            kept = {m: c for m, c in kept.items() if c and (self.exact or abs(c) > NOTHING)}
            high = [(m, a) for m in kept for a, e in m if a in rules and e >= rules[a][0]]
            if not high:
                return Laurent(self, kept) if kept else 0
            for m, c, a in [(m, kept.pop(m), a) for m, a in dict(high).items()]:
                power, value = rules[a]
                left = _product(m, ((a, -power),))
                for b, d in self._terms(value).items():
                    product = _product(left, b)
                    kept[product] = kept[product] + c * d if product in kept else c * d

    def _terms(self, e: Formula) -> dict[Monomial, Number]:
        return e.terms if isinstance(e, Laurent) else {(): self.number(e)}

    def _atom(self, key: Hashable, expression: Any) -> int:
        if key not in self._known:
            self._known[key] = len(self.expressions)
            self.expressions.append(expression)
        return self._known[key]

    def power(self, base: Formula, exponent: Exponent) -> Formula:
        """Return base^exponent of a formula."""
        exponent = _short(exponent)
        if not isinstance(base, Laurent):
            base = Laurent(self, {(): self.number(base)})
        shared, (c, base) = self._shared(base), self._normal(base)
        if len(base.terms) == 1 and (c == 1 or exponent.denominator == 1):
            raised = tuple((a, _short(e * exponent)) for a, e in shared)
            return Laurent(self, {raised: c ** int(exponent) if c != 1 else self.number(1)})
        if exponent.denominator != 1 and any(e % 2 == 0 for _, e in shared):
            shared, base = (), base * Laurent(self, {shared: self.number(1)})  # √x² is no x
        if exponent.denominator != 1 and c != 1:
            c, base = self.number(1), base * c
        key = ("sum", frozenset(base.terms.items()))
        atom = self._atom(key, None)
        if self.expressions[atom] is None:
            self.expressions[atom] = self.written(base)
            self._rules |= self._solved(atom, base)
        raised = tuple((a, _short(e * exponent)) for a, e in shared)
        raised = _product(((atom, exponent),), raised)
        return Laurent(self, {raised: c ** int(exponent) if c != 1 else self.number(1)})

    def _shared(self, base: Laurent) -> Monomial:
        """Return the monomial that all terms have as a factor."""
        parts = [dict(m) for m in base.terms]
        least = {a: min(m.get(a, 0) for m in parts) for m in parts for a in m}
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
                self._rules[atom] = (2, self.number(1) - sine * sine)
        return Laurent(self, {((atom, 1),): self.number(1)})

    def namespace(self) -> Namespace:
        """Return the functions of these coefficients, by their names in generated text."""
        names = ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log")
        own = {name: lambda e, name=name: self.function(name, e) for name in names}
        return {**own, "sqrt": lambda e: self.power(e, Fraction(1, 2))}

    def _solved(self, atom: int, base: Laurent) -> Rules:
        """Return the rules that an atom, the sum `base`, gives for parts of the sum."""
        return next(filter(self._ends, self._candidates(atom, base)), {})

    def _candidates(self, atom: int, base: Laurent) -> Iterator[Rules]:
        """Yield rules for a square that is in one term alone, then for such a function.

        A rule that the function's square has is solved for the square of another atom.
        """
        own = Laurent(self, {((atom, 1),): self.number(1)})
        alone = self._alone(base)
        for a in (a for a, e in alone if e == 2 and a not in self._rules):
            yield {a: (2, self._other(base, a, own))}
        for a in (a for a, e in alone if e == 1 and self.expressions[a].is_Function):
            value = self._other(base, a, own)
            power, square = self._rules.get(a, (0, 0))
            if not power:
                yield {a: (1, value)}
            elif power == 2 and isinstance(square, Laurent):
                for b in (b for b, e in self._alone(square) if e == 2 and b not in self._rules):
                    yield {a: (1, value), b: (2, self._other(square, b, value * value))}

    def _ends(self, new: Rules) -> bool:
        """Return True if with new rules no atom is expressed by itself, at last."""
        rules, reached = self._rules | new, set[int]()
        front = set(new)
        while front:
            values = [self._terms(rules[a][1]) for a in front if a in rules]
            front = {b for terms in values for m in terms for b, _ in m} - reached
            reached |= front
        return not reached & new.keys()

    def _alone(self, base: Laurent) -> list[tuple[int, Exponent]]:
        """Return the atoms that are in one term of a sum alone, with exponents; last ones first."""
        pairs = sorted((pair for m in base.terms for pair in m), reverse=True)
        times = Counter(a for a, _ in pairs)
        return [(a, e) for a, e in pairs if times[a] == 1]

    def _other(self, base: Laurent, a: int, value: Formula) -> Formula:
        """Return the power of an atom in base = value, the atom being in one term of base."""
        (m,) = (m for m in base.terms if any(b == a for b, _ in m))
        rest = Laurent(self, {k: e for k, e in base.terms.items() if k != m})
        below = tuple((b, -e) for b, e in m if b != a)
        return (value - rest) * Laurent(self, {below: self.number(1) / base.terms[m]})

    def is_zero(self, formula: Formula) -> bool:
        """Return True if a formula vanishes, at `POINTS` random points where it has a value."""
        if not isinstance(formula, Laurent):
            return formula == 0
        letters = {s for e in self.expressions for s in e.free_symbols}
        draw, left = random.Random(0), POINTS
        for _ in range(10 * POINTS):
            at = {s: sympy.Rational(draw.randint(-(10**6), 10**6), 10**6) for s in letters}
            terms = [e.evalf(DIGITS, subs=at) for e in sympy.Add.make_args(self.written(formula))]
            sizes = [abs(e) for e in terms]
            if not all(e.is_finite for e in sizes):
                continue
            if abs(sympy.Add(*terms)) > NOTHING * max(sizes):
                return False
            left -= 1
            if not left:
                return True
        return False

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
        for m, c in self.atoms._terms(other).items():
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
    return tuple(sorted((atom, _short(e)) for atom, e in exponents.items() if e))


def _short(e: Exponent) -> Exponent:
    return e if type(e) is int or e.denominator != 1 else int(e)
