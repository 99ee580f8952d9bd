"""The leading error of a rule, L_d − exact L_d = h^(p+1) Σ c_i e_i + O(h^(p+2)).

A term e(x, v) in L_d moves the step by h^(p+1) (−M⁻¹e_v, e_x − L_xv M⁻¹e_v), M = L_vv. The
coefficients c solve these linear equations in F_p, for as many components as a random state has:
the errors have to be such a sum in all of them. Of order 4 the terms are those of
L = v·Mv/2 − V(x).
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from discmech.integrators import Discretisation, pair
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.extensions.expansions import series_function
from discmech.integrators.numbers import (
    NotRational,
    jacobian,
    numeric_text,
    small_fraction,
    sympy,
)

from .classes import SceneClass
from .conditions import NotInterpolated, of_values
from .constants import Numbers, numbers_for
from .letters import Told, lettered
from .steps import Comparison

MOST_DRAWN = 2  # fields whose images give a coefficient


class Derivatives:
    """Derivatives of a scene's Lagrangian at (x, v), of which terms are made."""

    def __init__(self, s: Any) -> None:
        self.x, self.v, self.L = sympy.Matrix(s.x), sympy.Matrix(s.u), s.lagrangian
        self.L_x, self.L_v = (jacobian([self.L], e).T for e in (self.x, self.v))
        self.L_vx, self.M = (jacobian(list(self.L_v), e) for e in (self.x, self.v))
        self.inverse = self.M.adjugate() / self.M.det()
        self.f = self.L_x - self.L_vx * self.v

    def along(self, *directions: Any) -> Any:
        """Return the derivative of L by x, once along each direction."""
        letters = [sympy.Dummy() for _ in directions]
        swap = {e: e + sympy.Add(*(a * d[i] for a, d in zip(letters, directions, strict=True)))
                for i, e in enumerate(self.x)}  # fmt: skip
        value = self.L.xreplace(swap)
        for a in letters:
            value = value.diff(a).xreplace({a: sympy.Integer(0)})
        return value

    def moved(self, e: Any) -> list[Any]:
        """Return what a term adds to (x, μ)."""
        speed = self.inverse * jacobian([e], self.v).T
        return [*(-speed), *(jacobian([e], self.x).T - self.L_vx.T * speed)]


Terms = dict[str, Callable[[Derivatives], Any]]
#: order ↦ (part of the class, the terms of the leading error by name)
TERMS: dict[int, tuple[str, Terms]] = {
    1: ("", {"L_x·v": lambda d: d.along(d.v)}),
    2: ("", {
        "v·L_xx v": lambda d: d.along(d.v, d.v),
        "f·M⁻¹f": lambda d: (d.f.T * d.inverse * d.f)[0],
    }),
    4: ("quadratic", {
        "L_xxxx(v, v, v, v)": lambda d: d.along(d.v, d.v, d.v, d.v),
        "L_xxx(v, v, a)": lambda d: d.along(d.v, d.v, d.inverse * d.f),
        "L_xx v·M⁻¹L_xx v": lambda d: _square(d, jacobian([d.along(d.v)], d.x).T),
        "a·L_xx a": lambda d: d.along(d.inverse * d.f, d.inverse * d.f),
    }),
}  # fmt: skip


def _square(d: Derivatives, covector: Any) -> Any:
    return (covector.T * d.inverse * covector)[0]


def leading_error(
    rule: Discretisation, names: Sequence[str], order: int | None, of: SceneClass,
    draw: random.Random,
) -> dict[str, Any]:  # fmt: skip
    """Return {name of a term: its coefficient}, a fraction or a function of one open number.

    order: the exact one of the rule; of: the class of pairs that gives the dimension. {} where
    the terms are not known, or the error is no such sum.
    """
    if order not in TERMS or len(names) > 1:
        return {}
    part, terms = TERMS[order]
    comparison = Comparison(replace(of, part=part).scene(order + 1), rule)
    derivatives = Derivatives(comparison.s)
    s = comparison.s
    letters = {"x": s.x, "u": s.u, "p": s.parameter_list}
    text = numeric_text(letters, [derivatives.moved(of(derivatives)) for of in terms.values()])
    every = [c for one in comparison.constants for c in one]
    fields = [numbers_for(every, comparison.scheme, draw) for _ in range(MOST_DRAWN)]
    if any(numbers.unknown for numbers in fields):
        return {}
    images = [_in_field(comparison, numbers, text, len(terms), names, order, draw)
              for numbers in fields]  # fmt: skip
    if any(e is None for e in images):
        return {}
    return {name: c for name, c in zip(terms, _common(images, names), strict=True) if c is not None}


def no_leading_error(order: int | None, names: Sequence[str]) -> str:
    """Return a sentence that says why a rule has no leading error, with these open numbers."""
    every = f" for every value of {', '.join(names)}" if names else ""
    if order not in TERMS:
        return f"no leading error: it is known if the order is 1, 2 or 4{every}."
    if len(names) > 1:
        return "no leading error: it is known of one open number at most."
    return f"no leading error: it is no sum of {', '.join(TERMS[order][1])}{every}."


def of_rule(rule: Discretisation) -> dict[str, Any]:
    """Return the leading error of a rule without open numbers on pairs, by the order it states."""
    e, draw = SceneClass("", "pair", pair(2)), random.SystemRandom()
    return leading_error(lettered(rule, Told()), (), rule.order, e, draw)


def _common(rows: Sequence[Any], names: Sequence[str]) -> list[Any]:
    """Return the coefficients by their images: fractions, or quotients of polynomials."""
    if not names:
        return [small_fraction(images) for images in zip(*rows, strict=True)]
    letter, told = sympy.Symbol(names[0]), []
    for images in zip(*rows, strict=True):  # (numerator, denominator) in each field
        parts = []
        for polynomials in zip(*images, strict=True):
            if len({*map(len, polynomials)}) != 1:
                raise NotInterpolated("two draws differ in the degree of a coefficient")
            fractions = [small_fraction(e) for e in zip(*polynomials, strict=True)]
            if None in fractions:
                return [None] * len(rows[0])
            known = [sympy.Rational(e.numerator, e.denominator) for e in fractions if e is not None]
            parts.append(sympy.Add(*(e * letter**k for k, e in enumerate(known))))
        told.append(sympy.factor(parts[0] / parts[1]))
    return told


def _in_field(
    comparison: Comparison, numbers: Numbers, text: str, count: int, names: Sequence[str],
    order: int, draw: random.Random,
) -> list[Any] | None:  # fmt: skip
    """Return the images of the coefficients in a field, or (numerator, denominator) of each."""
    try:
        function = series_function(text, numbers.field)
    except RecursionError:
        return None
    seed = draw.getrandbits(64)

    def solved(value: Any = None) -> list[Any] | None:
        numbers.values = {} if value is None else {names[0]: value}
        try:
            return _solved(comparison, numbers, function, count, order, random.Random(seed))
        except (CannotMeasure, NotRational, ZeroDivisionError):
            return None

    if not names:
        return solved()
    return of_values(numbers, solved)


def _solved(
    comparison: Comparison, numbers: Numbers, function: Any, count: int, order: int,
    draw: random.Random,
) -> list[Any] | None:  # fmt: skip
    """Return c with Σ c_i (what term i moves) = gaps at several states; None if there is none."""
    from flint import nmod_mat

    field, s = numbers.field, comparison.s
    columns: list[list[int]] = []
    for _ in range(-(-(count + 1) // (len(s.x) + len(s.mu))) + 1):
        state = draw.getrandbits(64)
        gap = comparison.gaps(numbers, random.Random(state), order + 1).rows[order + 1]
        again = random.Random(state)
        p, x, v = (field.random(len(e), again) for e in (s.parameter_list, s.x, s.u))
        moved = function(x, v, p) if count > 1 else [function(x, v, p)]
        columns += [[*(field.number(row[i]).v for row in moved), e.v] for i, e in enumerate(gap)]
    whole = nmod_mat(len(columns), count + 1, [e for row in columns for e in row], field.p)
    reduced, rank = whole.rref()
    if rank != count or any(int(reduced[i, i]) != 1 for i in range(count)):
        return None  # the terms are dependent, or the gaps no sum of them
    return [field.number(int(reduced[i, count])) for i in range(count)]
