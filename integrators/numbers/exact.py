"""Exact numbers: a scene's data are integers, fractions, decimal strings or exact expressions.

A float is its exact binary value; write "0.1" for one tenth. Double precision rounds each number
once, and high precision never sees a rounded one.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from numbers import Complex, Integral, Real
from typing import Any

from ..errors import BadInput, shown
from .lazy import sympy
from .long_numbers import refuse_long, refuse_unwritten
from .types import Exact, Expression

#: parts of an expression that stand one inside another, products not counted. Derivatives of what
#: is nested n times have n³ parts where they are written: a hundred sines are derived in ten
#: seconds, a hundred sums of Horner's form in four, three hundred sines never
DEEPEST = 100
SHALLOW, FRAMES = 20, 100  # from which depth on Python needs more calls than its 1000, and how many
LARGEST_COUNT = 2**53  # the last whole number that double precision counts to
SMALLEST = Fraction(1, 10**300)  # whose inverse and half are doubles, too


def exact(value: Any, what: str) -> Exact:
    """`value` as a Fraction, or unchanged if it is an exact sympy number.

    Raises `BadInput` (naming `what`) for text that is no number, for nan and for infinities, and
    for numbers of more than 4,200 digits.
    """
    number = _read(value, what)
    if isinstance(number, Fraction):
        refuse_long((number.numerator, number.denominator), what)
    return number


@contextmanager
def within_doubles(what: str) -> Iterator[None]:
    """Raise `BadInput` where the block meets a whole number that no double can hold."""
    try:
        yield
    except OverflowError:
        raise BadInput(
            f"{what} has a number that is larger than any double: choose units that fit the motion."
        ) from None


def refuse_large(expression: Expression, what: str) -> None:
    """Raise `BadInput` for a long number, and where too many parts stand inside one another.

    Up to `DEEPEST` it lets Python go as deep as derivatives of such an expression need.
    """
    level, depth = {expression}, 0
    while level:
        depth += 1
        if depth > DEEPEST:
            raise BadInput(
                f"{what} has more than {DEEPEST} functions, sums and powers one inside another, "
                "and its second derivatives would never be done: end such a loop sooner, or write "
                "what it goes to."
            )
        level = _inside(level)
    refuse_unwritten(expression, what)
    if depth > SHALLOW:
        sys.setrecursionlimit(max(sys.getrecursionlimit(), FRAMES * depth))


def _inside(level: set[Expression]) -> set[Expression]:
    """What stands in the arguments of these, and in the factors of those that are products."""
    found, pending = set[Expression](), [part for e in level for part in e.args]
    while pending:
        part = pending.pop()
        if part.is_Mul:
            pending.extend(part.args)
        else:
            found.add(part)
    return found


def _read(value: Any, what: str) -> Exact:
    if isinstance(value, bool) or getattr(getattr(value, "dtype", None), "kind", "") == "b":
        raise BadInput(f"{what} is {shown(value)}: give a number, not a truth value.")
    if isinstance(value, str):
        if re.search(r"[eE][+-]?0*[1-9]\d{4}", value):  # its integer alone would fill the memory
            raise BadInput(f"{what} is {value}: choose units that fit the motion.")
        try:
            return Fraction(value.strip())
        except (ValueError, ZeroDivisionError):
            raise BadInput(
                f'{what} is "{value}", which is no number: write a decimal ("0.1") '
                'or a fraction ("1/3").'
            ) from None
    if getattr(value, "is_Rational", False):  # sympy's
        return Fraction(int(value.p), int(value.q))
    if hasattr(value, "_mpf_") and not hasattr(value, "as_mantissa_exp"):  # not gmpy2's
        sign, mantissa, exponent, _ = value._mpf_
        if not mantissa and exponent:
            raise BadInput(f"{what} is {value}: give a finite number.")
        return Fraction(-int(mantissa) if sign else int(mantissa)) * Fraction(2) ** int(exponent)
    if getattr(value, "is_number", False):  # an exact sympy number such as sqrt(2)/2
        refuse_unwritten(value, what)
        if not value.is_real or not value.is_finite:
            raise BadInput(f"{what} is {value}: give a finite real number.")
        return value
    if getattr(value, "shape", None) == () and not hasattr(value, "as_integer_ratio"):
        value = value.item()  # numpy's integers, and arrays of no dimension
    try:
        return Fraction(*map(int, value.as_integer_ratio()))
    except (OverflowError, ValueError):
        raise BadInput(f"{what} is {value}: give a finite number.") from None
    except (AttributeError, TypeError):
        raise BadInput(
            f"{what} is {shown(value)} of type {type(value).__name__}: give a number."
        ) from None


def exact_rational(value: Any, what: str) -> Fraction:
    """A Fraction, for steps and durations; raises `BadInput` as `exact` does, or if irrational."""
    number = exact(value, what)
    if not isinstance(number, Fraction):
        raise BadInput(
            f"{what} is {shown(value)}: give a fraction or a decimal, nothing irrational."
        )
    return number


def measure(value: Any, what: str) -> Fraction:
    """`exact_rational` for what is also a double: a time, a tolerance, a length.

    Raises `BadInput` beyond 1e-300 or 1e300, too.
    """
    number = exact_rational(value, what)
    if number and not SMALLEST <= abs(number) <= 1 / SMALLEST:
        raise BadInput(f"{what} is beyond 1e-300 or 1e300: choose units that fit the motion.")
    return number


def whole_number(name: str, value: object, least: int) -> int:
    """A count that a user gave; raises `BadInput` for what is none."""
    whole = isinstance(value, Integral) and not isinstance(value, bool)
    if not whole or not least <= value <= LARGEST_COUNT:  # type: ignore[operator]
        raise BadInput(
            f"{name} is {shown(value)}: give a whole number from {least}, "
            "up to 2**53, the last that double precision counts to."
        )
    return int(value)  # type: ignore[call-overload]


def exact_vector(values: Any, length: int, what: str) -> tuple[Exact, ...]:
    """A tuple of `length` exact numbers; raises `BadInput` for any other shape."""
    entries = listed(values, length, what)
    return tuple(exact(entry, f"{what}[{i}]") for i, entry in enumerate(entries))


def listed(values: Any, length: int, what: str) -> list[Any]:
    """The `length` entries as they are; raises `BadInput` (naming `what`) for another shape."""
    many = isinstance(values, Iterable) or hasattr(values, "shape")  # a sympy column too
    if isinstance(values, str) or not many or getattr(values, "shape", None) == ():
        raise BadInput(f"{what} is {shown(values)}: give a list of {length} numbers.")
    entries = list(values)
    if len(entries) != length:
        raise BadInput(f"{what} has {len(entries)} entries, but {length} are needed: {entries}.")
    return entries


def exact_nested(value: Any, what: str) -> Any:
    """Numbers, lists and lists of lists of numbers, exact throughout (tuples for lists)."""
    many = isinstance(value, Iterable) and getattr(value, "shape", None) != ()
    if many and not isinstance(value, str):
        return tuple(exact_nested(entry, f"{what}[{i}]") for i, entry in enumerate(value))
    return exact(value, what)


def exact_matrices(values: Any, what: str) -> tuple[tuple[tuple[Exact, ...], ...], ...]:
    """Matrices as nested tuples of exact numbers: given as rows, or as numpy's or sympy's.

    Entries may be complex. Raises `BadInput` for what is no list of matrices of numbers.
    """
    return tuple(
        tuple(
            tuple(_entry(e, f"{at}[{i}, {j}]") for j, e in enumerate(_list(row, at)))
            for i, row in enumerate(_list(matrix, at))
        )
        for at, matrix in ((f"{what}[{k}]", m) for k, m in enumerate(_list(values, what)))
    )


def _list(values: Any, what: str) -> list[Any]:
    values = values.tolist() if hasattr(values, "tolist") else values
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise BadInput(
            f"{what} holds {shown(values)} where rows are needed: give a list of matrices, each a "
            "list of rows, such as [[0, -1], [1, 0]]."
        )
    return list(values)


def _entry(value: Any, what: str) -> Exact:
    """An exact number, whole ones as int; Python's complex numbers and sympy's stay."""
    if isinstance(value, Complex) and not isinstance(value, Real) and value.imag:
        for part in (value.real, value.imag):
            exact(part, what)
        return complex(value)
    if getattr(value, "is_number", False):
        refuse_unwritten(value, what)
        if value.is_finite and value.is_real is False:
            return value
    number = exact(value.real if isinstance(value, complex) else value, what)
    whole = isinstance(number, Fraction) and number.denominator == 1
    return number.numerator if whole else number


def to_sympy(value: Exact) -> Expression:
    """An exact number (as `exact` makes it) as a sympy number."""
    return sympy.Rational(value) if isinstance(value, Fraction) else value


def floats_exact(expression: Any) -> Expression:
    """A sympy expression with each float replaced by its exact binary value.

    Raises a `ValueError` for text: sympy would run it.
    """
    expression = sympy.sympify(expression, strict=True)
    floats = {f: sympy.Rational(f) for f in expression.atoms(sympy.Float)}
    return expression.xreplace(floats) if floats else expression


def flatten(value: Any) -> list[Exact]:
    """The numbers of a nested tuple, in order."""
    return [n for entry in value for n in flatten(entry)] if isinstance(value, tuple) else [value]
