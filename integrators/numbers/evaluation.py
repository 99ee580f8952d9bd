"""Exact numbers as decimals: sympy expressions without symbols, each subexpression once.

sympy's own evalf visits a shared subexpression as often as it occurs, and raises its precision
without end for a zero. Functions of ours take part by a method `in_arithmetic(numbers, values)`.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from .arithmetic import arithmetic
from .elementary import FUNCTIONS
from .lazy import sympy


def evaluate(expression: Any, digits: int) -> Any:
    """The value of an expression without symbols: a gmpy2 number, complex if the value is.

    It has that many digits and guard digits.
    """
    numbers = arithmetic(digits)
    with numbers.working():
        return _value(expression, numbers, {})


def evaluate_matrix(matrix: Any, digits: int) -> Any:
    """A sympy matrix of numbers with its entries as Floats."""
    numbers = arithmetic(digits)
    known: dict[Any, Any] = {}

    def decimal(e: Any) -> Any:
        value = _value(e, numbers, known)
        parts = [sympy.Float(str(part), digits) for part in (value.real, value.imag)]
        return parts[0] + sympy.I * parts[1] if value.imag != 0 else parts[0]

    with numbers.working():
        return matrix.applyfunc(decimal)


def number(expression: Any, bits: int) -> Any:
    """The same as an mpmath number that is right to so many bits."""
    digits = -(-bits * 30103 // 4_000_000) * 40 + 20  # few different precisions
    numbers = arithmetic(digits)
    with numbers.working():
        return numbers.public([_value(expression, numbers, {})])[0]


@cache
def _functions(numbers: Any) -> dict[str, Any]:
    return {**numbers.namespace(), "abs": abs}


def _value(e: Any, numbers: Any, known: dict[Any, Any]) -> Any:
    if e in known:
        return known[e]
    if e.is_Rational:
        value = numbers.number(e)
    elif not e.args and e.is_real is False:  # never ask a sum: sympy would evaluate its tables
        value = numbers.imaginary_unit
    elif not e.args:
        value = numbers.number(e)  # π and the like
    else:
        value = _of_parts(e, [_value(a, numbers, known) for a in e.args], numbers)
    known[e] = value
    return value


def _of_parts(e: Any, parts: list[Any], numbers: Any) -> Any:
    if e.is_Add:
        return sum(parts[1:], parts[0])
    if e.is_Mul:
        product = parts[0]
        for part in parts[1:]:
            product = product * part
        return product
    if e.is_Pow and e.exp.is_Integer:
        return parts[0] ** int(e.exp)
    if e.is_Pow:
        return parts[0] ** parts[1]
    if hasattr(e, "in_arithmetic"):
        return e.in_arithmetic(numbers, parts)
    name = FUNCTIONS.get(type(e).__name__)
    return _functions(numbers)[name](*parts) if name else numbers.number(e)
