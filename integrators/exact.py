"""Exact numbers: a scene's data are integers, fractions, decimal strings or exact expressions.

A float is its exact binary value; write "0.1" for one tenth. Double precision rounds each number
once, and high precision never sees a rounded one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from fractions import Fraction
from numbers import Rational, Real
from typing import Any

from .errors import BadInput


def exact(value: Any, what: str) -> Any:
    """`value` as a Fraction, or unchanged if it is an exact sympy number.

    Raises `BadInput` (naming `what`) for text that is no number, for nan and for infinities.
    """
    if isinstance(value, bool):
        raise BadInput(f"{what} is {value!r}: give a number, not a truth value.")
    if isinstance(value, Rational):
        return Fraction(value)
    if isinstance(value, str):
        try:
            return Fraction(value.strip())
        except (ValueError, ZeroDivisionError):
            raise BadInput(
                f'{what} is "{value}", which is no number: write a decimal ("0.1") '
                'or a fraction ("1/3").'
            ) from None
    if hasattr(value, "as_mantissa_exp"):  # a gmpy2 number
        if not math.isfinite(value):
            raise BadInput(f"{what} is {value}: give a finite number.")
        return Fraction(*map(int, value.as_integer_ratio()))
    if hasattr(value, "_mpf_"):  # an mpmath number: its exact binary value
        sign, mantissa, exponent, _ = value._mpf_
        if not mantissa and exponent:
            raise BadInput(f"{what} is {value}: give a finite number.")
        return Fraction(-int(mantissa) if sign else int(mantissa)) * Fraction(2) ** int(exponent)
    if isinstance(value, Real) or hasattr(value, "dtype"):
        number = float(value)
        if not math.isfinite(number):
            raise BadInput(f"{what} is {number}: give a finite number.")
        return Fraction(number)
    if hasattr(value, "as_integer_ratio") and getattr(value, "is_Rational", False):
        return Fraction(*value.as_integer_ratio())
    if getattr(value, "is_Float", False):
        return Fraction(*value.as_integer_ratio())
    if getattr(value, "is_number", False):  # an exact sympy number such as sqrt(2)/2
        if not value.is_real or not value.is_finite:
            raise BadInput(f"{what} is {value}: give a finite real number.")
        return value
    raise BadInput(f"{what} is {value!r} of type {type(value).__name__}: give a number.")


def exact_vector(values: Any, length: int, what: str) -> tuple[Any, ...]:
    """A tuple of `length` exact numbers; raises `BadInput` if the shape is another."""
    if isinstance(values, str) or not isinstance(values, Iterable):
        raise BadInput(f"{what} is {values!r}: give a list of {length} numbers.")
    entries = list(values)
    if len(entries) != length:
        raise BadInput(f"{what} has {len(entries)} entries, but {length} are needed: {entries}.")
    return tuple(exact(entry, f"{what}[{i}]") for i, entry in enumerate(entries))


def exact_nested(value: Any, what: str) -> Any:
    """Numbers, lists and lists of lists of numbers, exact throughout (tuples for lists)."""
    if not isinstance(value, str) and isinstance(value, Iterable):
        return tuple(exact_nested(entry, f"{what}[{i}]") for i, entry in enumerate(value))
    return exact(value, what)


def to_sympy(value: Any) -> Any:
    """An exact number (as `exact` makes it) as a sympy number."""
    from sympy import Rational

    is_fraction = isinstance(value, Fraction)
    return Rational(value.numerator, value.denominator) if is_fraction else value


def flatten(value: Any) -> list[Any]:
    """The numbers of a nested tuple, in order."""
    return [n for entry in value for n in flatten(entry)] if isinstance(value, tuple) else [value]
