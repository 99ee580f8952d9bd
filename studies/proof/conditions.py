"""For which values of its open numbers a rule has an order: polynomials, by interpolation in F_p.

At a random state of a random scene each component of an error is a rational function of the open
number w. Its numerator follows from values (the extended Euclidean algorithm: von zur Gathen,
Gerhard, Modern Computer Algebra, 5.7), and the common divisor of all numerators is the condition.
Of several open numbers an error is taken for a polynomial, whose coefficients are solved for; all
errors span a space of polynomials, the reduced basis of which has fractions as coefficients.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from discmech.integrators import Discretisation
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.numbers import Residue, small_fraction, sympy

from .classes import SceneClass
from .constants import Numbers, numbers_for
from .result import Answer
from .steps import Comparison, Gaps

EVERY, NONE = "for every value of {}", "for no value of {}"
NONE_MORE = f"{EVERY}, and further for none"
Defect = Callable[..., Gaps]
STATES = 2  # random states, each of a random scene, in each of two fields
POINTS = (6, 12, 24, 48, 96)  # values of an open number until its rational functions are known
MOST_DEGREE = 6  # of polynomials in several open numbers
FURTHER = 3  # orders beyond the stated one that are asked for
MOST = 130  # coefficients of a class whose errors are interpolated


class NotInterpolated(CannotMeasure):
    """The errors are no rational functions of a degree that is looked for."""


class Condition:
    """The values of open numbers at which some polynomials vanish; none, one or a basis of them."""

    def __init__(self, names: Sequence[str], polynomials: Sequence[Any]) -> None:
        self.names, self.polynomials = tuple(names), tuple(polynomials)

    @property
    def always(self) -> bool:
        """True if it holds for every value."""
        return not self.polynomials

    @property
    def never(self) -> bool:
        """True if it holds for no value, real or complex."""
        return any(e.is_number for e in self.polynomials)

    def __str__(self) -> str:
        several = ", ".join(self.names)
        if self.always or self.never:
            return (EVERY if self.always else NONE).format(several)
        said = ", ".join(f"{sympy.sstr(e)} = 0" for e in self.polynomials)
        if len(self.names) > 1:
            return said
        values = self.values
        return f"{said}: {values}" if values else f"{said}: for no real {several}"

    @property
    def values(self) -> str:
        """The real values of one open number, "" if there are none."""
        roots = sympy.Poly(self.polynomials[0], sympy.Symbol(self.names[0])).real_roots()
        return " or ".join(f"{self.names[0]} = {e if len(str(e)) < 40 else e.evalf(12)}"
                           for e in dict.fromkeys(roots))  # fmt: skip


def conditions_of(
    rule: Discretisation, names: Sequence[str], classes: Sequence[SceneClass], stated: int,
    answers: dict[str, Answer], draw: random.Random,
) -> tuple[dict[int, str], dict[str, Answer]]:  # fmt: skip
    """Return {order: condition} and the answers, of which those that depend on the values say so.

    The errors are those of the first class, and of the second if it is not too large; the others
    are tried at the values that are found.
    """
    conditions = _found(rule, names, classes[0], stated + 1, draw)
    power = stated + 1
    while not conditions[-1].never and power < stated + FURTHER:
        power += 1
        conditions = _found(rule, names, classes[0], power, draw)
    if len(classes) > 1 and classes[1].count(power) <= MOST:
        others = _found(rule, names, classes[1], power, draw)
        conditions = [_condition(a.names, [*a.polynomials, *b.polynomials])
                      for a, b in zip(conditions, others, strict=True)]  # fmt: skip
    singular = _singular(rule, names, classes[0], draw)
    told = {k: _said(conditions[k], singular) for k in range(1, power + 1)}
    condition, new = conditions[stated], dict(answers)
    for e in classes:
        answer = answers[e.name]
        if answer.proven is False and not condition.never and not condition.always:
            holds = _holds(rule, e, condition, stated, draw)
            said = {True: f"if {condition}", None: f"{answer.why}, unless {condition}",
                    False: f"{answer.why}, even if {condition}"}  # fmt: skip
            why = said[holds]
            new[e.name] = replace(answer, proven=None if holds is not False else False, why=why)
    return told, new


def of_law(
    rule: Discretisation, names: Sequence[str], e: SceneClass, defect: Defect, power: int,
    answer: Answer, draw: random.Random | None,
) -> Answer:  # fmt: skip
    """Return the answer to a law that fails, with the open numbers for which it holds further.

    draw: None where that is not to be looked at.
    """
    several = ", ".join(names)
    if draw is None:
        return replace(answer, proven=None, condition=f"for most {several}")
    try:
        conditions = _found(rule, names, e, power, draw, defect)
    except CannotMeasure as error:
        said = f"for most {several} ({str(error).rstrip('.')})"
        return replace(answer, proven=None, condition=said)
    further = {str(c): k for k, c in enumerate(conditions) if not (c.always or c.never)}
    if not further:
        return replace(answer, condition=f"only {NONE_MORE.format(several)}")
    more = " and ".join(f"to h^{k} if {said}" for said, k in further.items())
    return replace(answer, proven=None, condition=f"{EVERY.format(several)}, {more}")


def _said(condition: Condition, singular: Condition) -> str:
    """Return a condition as words, without the values at which a rule has no step."""
    if singular.always:
        return str(condition)
    if condition.always:
        return f"{condition} but {singular.values}, where it has no step"
    letters, of = list(map(sympy.Symbol, singular.names)), singular.polynomials[0]
    left = []
    for e in condition.polynomials:
        while (shared := sympy.gcd(e, of)).free_symbols:
            e = sympy.quo(e, shared, *letters)
        left.append(e)
    return str(Condition(condition.names, left))


def _singular(
    rule: Discretisation, names: Sequence[str], e: SceneClass, draw: random.Random
) -> Condition:
    """Return where the derivative of a step's rows is singular at h = 0, whatever the scene is.

    It has no polynomials where there is no such value, and of several open numbers.
    """
    if len(names) > 1:
        return Condition(names, ())
    comparison, images = Comparison(e.scene(2), rule), []
    every = [c for part in comparison.constants for c in part]
    for _ in range(2):
        numbers = numbers_for(every, comparison.scheme, draw)
        field, shared = numbers.field, numbers.field.polynomial([0])
        for _ in range(STATES):
            seed = draw.getrandbits(64)

            def entries(value: Residue, numbers: Numbers = numbers, seed: int = seed) -> Any:
                numbers.values = {names[0]: value}
                comparison.gaps(numbers, random.Random(seed), 1)
                return comparison.inverses

            poles = field.polynomial([1])
            for _, bottom in of_values(numbers, entries) or ():
                pole = field.polynomial(list(bottom))
                poles = poles * (pole // poles.gcd(pole))
            shared = shared.gcd(poles)
        images.append(_monic(field, shared))
    if len(images[0]) != len(images[1]):
        raise NotInterpolated("two draws differ in the values at which there is no step")
    polynomial = _rational(images, names, 2)
    return _condition(names, [polynomial] if polynomial.free_symbols else [])


def _condition(names: Sequence[str], polynomials: Sequence[Any]) -> Condition:
    """Return the condition that all polynomials vanish, with as few as say it."""
    letters = list(map(sympy.Symbol, names))
    if not polynomials:
        return Condition(names, ())
    basis = sympy.groebner(polynomials, *letters, order="grevlex").exprs
    if len(names) == 1:
        basis = [sympy.Poly(basis[0], *letters).sqf_part().as_expr()]
    return Condition(names, [sympy.Poly(e, *letters).primitive()[1].as_expr() for e in basis])


def _found(
    rule: Discretisation, names: Sequence[str], e: SceneClass, power: int, draw: random.Random,
    defect: Defect = Comparison.gaps,
) -> list[Condition]:  # fmt: skip
    """Return the condition under which all errors up to h^k vanish, for k = 0, …, power.

    defect: what vanishes; by default what a step and the flow differ by.
    """
    comparison = Comparison(e.scene(power), rule)
    every = [c for part in comparison.constants for c in part]
    fields = [numbers_for(every, comparison.scheme, draw) for _ in range(2)]
    spans = [
        (_of_one if len(names) == 1 else _of_several)(
            partial(defect, comparison), numbers, names, power, draw
        )
        for numbers in fields
    ]
    conditions, polynomials = [], list[Any]()
    for k in range(power + 1):
        parts = [span[k] for span in spans]
        if len({tuple(map(len, part)) for part in parts}) != 1 or len({*map(len, parts)}) != 1:
            raise NotInterpolated("two draws differ in the degree of a condition")
        for images in zip(*parts, strict=True):
            polynomials.append(_rational(images, names, power))
        if polynomials:
            polynomials = list(_condition(names, polynomials).polynomials)
        conditions.append(Condition(names, polynomials))
    return conditions


def _rational(images: Sequence[list[Residue]], names: Sequence[str], power: int) -> Any:
    """Return a polynomial with fractions as coefficients by its images in two fields."""
    letters = list(map(sympy.Symbol, names))
    monomials = _monomials(len(names), len(images[0]))
    total = sympy.Integer(0)
    for monomial, e in zip(monomials, zip(*images, strict=True), strict=True):
        c = small_fraction(e)
        if c is None:
            raise NotInterpolated("a condition has a coefficient that is no short fraction")
        total += sympy.Rational(c.numerator, c.denominator) * sympy.Mul(
            *(x**k for x, k in zip(letters, monomial, strict=True)))  # fmt: skip
    return total


def _monomials(letters: int, count: int) -> list[tuple[int, ...]]:
    """Return exponents by total degree: 1, w, w², … of one letter."""
    exponents = [(0,) * letters]
    for degree in itertools.count(1):
        if len(exponents) >= count:
            return exponents[:count]
        exponents += [e for e in itertools.product(range(degree + 1), repeat=letters)
                      if sum(e) == degree]  # fmt: skip
    return exponents


def _of_one(
    defect: Defect, numbers: Numbers, names: Sequence[str], power: int,
    draw: random.Random,
) -> list[list[list[Residue]]]:  # fmt: skip
    """Return for each power of h the common divisor of the errors, monic; [] if they are all 0."""
    field = numbers.field
    divisors = [field.polynomial([0]) for _ in range(power + 1)]
    for _ in range(STATES):
        seed, rows, start = draw.getrandbits(64), list[Any](), draw.getrandbits(60)
        for count in POINTS:
            points = [field.number(start + i) for i in range(count)]
            for value in points[len(rows) :]:
                numbers.values = {names[0]: value}
                rows.append(defect(numbers, random.Random(seed), power).rows)
            numerators = [[_numerator(numbers, points, [r[k][i] for r in rows])
                           for i in range(len(rows[0][k]))] for k in range(power + 1)]  # fmt: skip
            if all(e is not None for row in numerators for e in row):
                break
        else:
            raise NotInterpolated("an error is no rational function of a low degree in "
                                  f"{names[0]}")  # fmt: skip
        for k, row in enumerate(numerators):
            for e in row:
                divisors[k] = divisors[k].gcd(e)
    answers = list[list[list[Residue]]]()
    for e in divisors:
        if e == 0:
            answers.append([])
            continue
        answers.append([_monic(field, e)])
    return answers


def _monic(field: Any, e: Any) -> list[Residue]:
    """Return the coefficients of the monic polynomial that has each zero of a polynomial once."""
    root = e // e.gcd(e.derivative()) if e.degree() > 0 else e
    lead = field.number(int(root.leading_coefficient()))
    return [field.number(int(c)) / lead for c in root.coeffs()]


def of_values(
    numbers: Numbers, of: Callable[[Residue], list[Residue] | None]
) -> list[tuple[list[Residue], list[Residue]]] | None:
    """Return numerator and denominator (monic) of functions of one open number by values.

    None where a value is missing, or no functions of a low degree have these.
    """
    field, rows, start = numbers.field, list[list[Residue]](), random.getrandbits(60)
    for size in POINTS:
        points = [field.number(start + i) for i in range(size)]
        for value in points[len(rows) :]:
            if (row := of(value)) is None:
                return None
            rows.append(row)
        ratios = [_quotient(numbers, points, [row[i] for row in rows]) for i in range(len(rows[0]))]
        if all(e is not None for e in ratios):
            break
    else:
        return None

    def over(e: Any, lead: Residue) -> list[Residue]:
        return [field.number(int(c)) / lead for c in e.coeffs()]

    leads = [field.number(int(bottom.leading_coefficient())) for _, bottom in ratios]
    return [(over(top, lead), over(bottom, lead))
            for (top, bottom), lead in zip(ratios, leads, strict=True)]  # fmt: skip


def _numerator(numbers: Numbers, points: list[Residue], values: list[Residue]) -> Any:
    quotient = _quotient(numbers, points, values)
    return None if quotient is None else quotient[0]


def _quotient(numbers: Numbers, points: list[Residue], values: list[Residue]) -> Any:
    """Return (numerator, denominator) of the function of least degree through points, or None."""
    field = numbers.field
    a, b = field.polynomial([1]), _interpolated(numbers, points, values)
    for e in points:
        a *= field.polynomial([-e, 1])
    u, w = field.polynomial([0]), field.polynomial([1])
    while 2 * b.degree() >= len(points):
        q = a // b
        a, b, u, w = b, a - q * b, w, u - q * w
    if b.degree() + w.degree() >= len(points) - 2:
        return None
    shared = b.gcd(w)
    return b // shared, w // shared


def _interpolated(numbers: Numbers, points: list[Residue], values: list[Residue]) -> Any:
    """Return the polynomial through points, by Newton's differences."""
    field, c = numbers.field, list(values)
    for j in range(1, len(points)):
        for i in range(len(points) - 1, j - 1, -1):
            c[i] = (c[i] - c[i - 1]) / (points[i] - points[i - j])
    total = field.polynomial([0])
    for e, coefficient in zip(reversed(points), reversed(c), strict=True):
        total = total * field.polynomial([-e, 1]) + field.polynomial([coefficient])
    return total


def _of_several(
    defect: Defect, numbers: Numbers, names: Sequence[str], power: int,
    draw: random.Random,
) -> list[list[list[Residue]]]:  # fmt: skip
    """Return for each power of h a reduced basis of the polynomials that errors are."""
    from flint import nmod_mat

    field, r = numbers.field, len(names)
    for degree in range(2, MOST_DEGREE + 1):
        monomials = [e for e in _monomials(r, 10**4) if sum(e) <= degree][: 10**4]
        monomials = [e for e in monomials if sum(e) <= degree]
        size = len(monomials)
        points = [field.random(r, draw) for _ in range(size + 2)]

        def at(point: Sequence[Residue], monomials: Any = monomials) -> list[int]:
            return [_product(field, point, e).v for e in monomials]

        inverse = nmod_mat(size, size, [e for z in points[:size] for e in at(z)], field.p).inv()
        coefficients: list[list[list[int]]] = [[] for _ in range(power + 1)]
        fits = True
        for _ in range(STATES * size if size < 6 else size):
            seed, rows = draw.getrandbits(64), list[Any]()
            for point in points:
                numbers.values = dict(zip(names, point, strict=True))
                rows.append(defect(numbers, random.Random(seed), power).rows)
            for k in range(power + 1):
                for i in range(len(rows[0][k])):
                    values = [row[k][i] for row in rows]
                    column = nmod_mat(size, 1, [e.v for e in values[:size]], field.p)
                    c = [int((inverse * column)[j, 0]) for j in range(size)]
                    fits = fits and all(
                        sum(a * b for a, b in zip(c, at(z), strict=True)) % field.p == e.v
                        for z, e in zip(points[size:], values[size:], strict=True)
                    )
                    coefficients[k].append(c)
            if not fits:
                break
        if fits:
            return [_reduced(field, rows, size) for rows in coefficients]
    raise NotInterpolated(f"an error is no polynomial of a degree up to {MOST_DEGREE} in "
                          f"{', '.join(names)}")  # fmt: skip


def _product(field: Any, point: Sequence[Residue], exponents: Sequence[int]) -> Residue:
    total = field.number(1)
    for x, k in zip(point, exponents, strict=True):
        total = total * x**k
    return total


def _reduced(field: Any, rows: list[list[int]], size: int) -> list[list[Residue]]:
    from flint import nmod_mat

    reduced, rank = nmod_mat(len(rows), size, [e for row in rows for e in row], field.p).rref()
    return [[field.number(int(reduced[i, j])) for j in range(size)] for i in range(rank)]


def _holds(
    rule: Discretisation, e: SceneClass, condition: Condition, order: int, draw: random.Random
) -> bool | None:
    """Return whether a class has the order at a value of one open number; None if none is tried."""
    if len(condition.names) > 1:
        return None
    letter = sympy.Symbol(condition.names[0])
    comparison = Comparison(e.scene(order), rule)
    every = [c for part in comparison.constants for c in part]
    for _ in range(100):
        numbers = numbers_for(every, comparison.scheme, draw)
        field = numbers.field
        c = [numbers.of(a) for a in reversed(sympy.Poly(condition.polynomials[0], letter)
                                             .all_coeffs())]  # fmt: skip
        roots = [int(r) for r, _ in field.polynomial(c).roots()]
        if len(roots) == len(c) - 1:
            numbers.values = {condition.names[0]: field.number(roots[0])}
            return comparison.gaps(numbers, draw, order).order >= order
    return None
