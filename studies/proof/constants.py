"""The numbers of a rule in F_p: fractions, roots, nodes, coefficients, and numbers left open.

A real number field is mapped into F_p by the images of its generators, and sums and products with
them. For roots of fractions any image will do that obeys √a √b = √(ab) (Besicovitch, J. London
Math. Soc. 15 (1940) 3: no other relation holds among real ones), which those of `PrimeField` do. A
root of another number a has two images unless a is a square already; a prime for which it is none
shows that it is not, and without such a prime nothing is decided.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from discmech.integrators.errors import CannotMeasure
from discmech.integrators.numbers import NotRational, PrimeField, Residue, exact, sympy
from discmech.integrators.rules import NodeValue, Share

TRIES = 4000  # primes that are looked at: nodes split for one in 48 up to gauss-6
CERTAIN = 60  # primes without a sign of a root's independence, of which each has it at 1/2


@dataclass(frozen=True)
class Open:
    """A number that a rule leaves open; called with digits it is some number."""

    name: str

    def __call__(self, digits: int) -> Any:
        return sympy.Float("0.3", digits)._to_mpmath(4 * digits)


@dataclass(frozen=True)
class Algebraic:
    """An irrational number of a formula, an expression of sympy; called with digits it is mpf."""

    expression: Any

    def __call__(self, digits: int) -> Any:
        return self.expression.evalf(digits)._to_mpmath(4 * digits)


class Numbers:
    """The images of a rule's numbers in one field; called with a constant it gives the image.

    values: those of open numbers. unknown: the constants of which nothing is known but a function
    of digits, or a transcendental number; they have random images, so that what is proven holds for
    every value, and what is disproven may hold for theirs.
    """

    def __init__(self, field: PrimeField, draw: random.Random) -> None:
        self.field, self._draw = field, draw
        self.values: Mapping[str, Residue] = {}
        self.unknown: dict[Any, Residue] = {}
        self.nested: dict[Any, Residue] = {}
        self._nodes: dict[tuple[str, int], list[Residue]] = {}

    def __call__(self, constant: Callable[..., Any]) -> Residue:
        if isinstance(constant, Open):
            return self.values[constant.name]
        if isinstance(constant, Algebraic):
            return self.of(constant.expression)
        if isinstance(constant, NodeValue):
            return self._node_value(constant)
        if isinstance(constant, Share):
            return self.of(constant.exact)
        return self._any(constant)

    def _any(self, key: Any) -> Residue:
        if key not in self.unknown:
            self.unknown[key] = self.field.random(1, self._draw)[0]
        return self.unknown[key]

    def of(self, number: Any) -> Residue:
        """Return the image of an exact number; raises `NotRational` where the field has none."""
        if not isinstance(number, sympy.Basic):
            return self.field.number(exact(number, "a number of the rule"))
        if number.is_Rational:
            return self.field.number(Fraction(int(number.p), int(number.q)))
        if number.is_Add or number.is_Mul:
            total = self.field.number(0 if number.is_Add else 1)
            for part in number.args:
                total = total + self.of(part) if number.is_Add else total * self.of(part)
            return total
        if number.is_Pow and number.exp.is_Rational:
            power = number.exp
            return self._root(number.base, int(power.q)) ** int(power.p)
        if number.is_Float:
            return self.of(sympy.Rational(number))
        return self._any(number)

    def _root(self, base: Any, degree: int) -> Residue:
        if degree == 1 or base.is_Rational or degree % 2:
            return self.field.root(self.of(base), degree)
        key = (base, degree)
        if key not in self.nested:
            try:
                self.nested[key] = self.field.root(self.of(base), degree)
            except NotRational as error:
                error.args = (*error.args, key)
                raise
        return self.nested[key]

    def _node_value(self, c: NodeValue) -> Residue:
        """Return a number at a node; nodes may stand in any order, as rules do not tell them
        apart."""
        x = self._at(c.family, c.count)[c.node]
        P = self.legendre
        if c.what == "c":
            return (x + 1) / 2
        if c.what == "P":
            return self._value(P(c.degree), x)
        if c.what == "Q":
            higher, lower = (self._value(P(c.degree + k), x) for k in (1, -1))
            return (higher - lower) / (4 * c.degree + 2)
        if c.family == "gauss":
            slope = self._value(P(c.count).derivative(), x)
            return 1 / ((1 - x * x) * slope**2)
        return 1 / (c.count * (c.count - 1) * self._value(P(c.count - 1), x) ** 2)

    def _value(self, polynomial: Any, x: Residue) -> Residue:
        return self.field.number(int(polynomial(x.v)))

    def legendre(self, n: int) -> Any:
        """Return the Legendre polynomial of degree n."""
        a, b = self.field.polynomial([1]), self.field.polynomial([0, 1])
        x = b
        for k in range(1, n):
            over = self.field.number(1) / (k + 1)
            a, b = b, (x * b * (2 * k + 1) - a * k) * over.v
        return b if n else a

    def _at(self, family: str, count: int) -> list[Residue]:
        """Return the nodes on [−1, 1], each as far from one end as its mirror from the other."""
        if (family, count) not in self._nodes:
            ends = family == "lobatto"
            polynomial = self.legendre(count - 1).derivative() if ends else self.legendre(count)
            roots = self.field.roots(polynomial)
            if roots is None:
                raise NotRational(f"the nodes of {family}-{count} are not in the field")
            minus_one = self.field.number(-1)
            half = [minus_one] * ends + [r for r in roots if 0 < 2 * r.v < self.field.p]
            middle = [self.field.number(0)] * (count % 2)
            self._nodes[family, count] = [*half, *middle, *(-r for r in reversed(half))]
        return self._nodes[family, count]

    def sizes(self, scheme: Any, substeps: Sequence[Any]) -> list[Residue]:
        """Return the share of each substep in the step; [1] for a rule of one step."""
        if not substeps:
            return [self.field.number(1)]
        every = self._coefficients(scheme.rule.method)
        places = [substep.coefficient.args for substep in substeps]
        return [every[index] / divisor for index, divisor in places]

    def _coefficients(self, method: Any) -> list[Residue]:
        if method.own is not None:
            return [self.of(e) for e in method.own.numbers]
        if method.jump:  # γ = 1/(c − c^(1/3)), c times, and 1 − cγ in the middle
            c, one = method.jump, self.field.number(1)
            first = one / (c - self.field.root(self.field.number(c), 3))
            half = [first] * (c // 2)
            return [*half, 1 - c * first, *half]
        # the last one of a half is what is missing to a sum of 1
        half = [self.of(exact(e, "a coefficient")) for e in method.halves(64)[:-1]]
        left = 1 - sum(half, start=self.field.number(0)) * 2
        return [*half, *([left / 2] * 2 if method.in_turn else [left]), *reversed(half)]


def decimals_in(rule: Any) -> str:
    """Return a sentence on coefficients that are rounded decimals; "" if all are exact."""
    method = rule.method
    if method is None or method.jump or (method.own is not None and not any(method.own.rounded)):
        return ""
    if method.own is None:
        missed = f"by {float(method.defect(64)):.0e}"
    else:
        words = method.own.first_missed(12)
        missed = "by less than their last digit" if words is None else f"by {float(words[1]):.0e}"
    return f"its coefficients are decimals, which miss the conditions of order {missed}"


def numbers_for(
    constants: Iterable[Callable[..., Any]], scheme: Any, draw: random.Random
) -> Numbers:
    """Return the images of constants in the field of a random prime that has them all.

    Raises `CannotMeasure` where no such prime is found.
    """
    singles, seen, primes = list(dict.fromkeys(constants)), set[Any](), 0
    own = getattr(scheme.rule.method, "own", None)
    every = [c.expression for c in singles if isinstance(c, Algebraic)]
    every += [e for e in (own.numbers if own else ()) if isinstance(e, sympy.Basic)]
    bases = [e for one in every for e in one.atoms(sympy.Pow) if e.base.is_Rational]
    missing = ""
    for _ in range(TRIES):
        numbers = Numbers(PrimeField.at_random(draw), draw)
        try:
            for e in bases:  # first, so that nested roots are seen to be independent of them
                numbers.of(e)
            for c in singles:
                if not isinstance(c, Open):
                    numbers(c)
            numbers.sizes(scheme, scheme.substeps)
        except NotRational as error:
            missing, key = str(error.args[0]), error.args[1:]
            seen |= set(key)
            continue
        if set(numbers.nested) <= seen:
            return numbers
        primes += 1
        if primes == CERTAIN:
            missing = "a root of a sum may be a sum of roots: write it so"
            break
    raise CannotMeasure(f"of its numbers the field has none: {missing}.")
