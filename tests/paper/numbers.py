"""Numbers of the audit: exact rationals, and what is irrational as a rational to 240 digits.

Derivatives are central difference quotients of such numbers over ε = 10⁻⁴⁰. They are off by ε²
times a third derivative, so that 40 digits can be demanded, and nothing is lost to rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from sympy import I, Matrix, Rational, sympify

from discmech.integrators.numbers import evaluate

DIGITS = 240
EPS = Rational(1, 10**40)


def number(expression: Any) -> Any:
    """A real or complex number as exact rational parts."""
    expression = sympify(expression)
    if expression.is_Rational:
        return expression
    value = evaluate(expression, DIGITS)
    real, imaginary = (
        Rational(*map(int, part.as_integer_ratio())) for part in (value.real, value.imag)
    )
    return real + I * imaginary


def numbers(matrix: Any) -> Any:
    """A matrix of expressions as a matrix of `number`s."""
    return matrix.applyfunc(number)


def slope(curve: Callable[[Any], Any]) -> Any:
    """d/dt at t = 0 of a number or matrix along a curve."""
    return (curve(EPS) - curve(-EPS)) / (2 * EPS)


def mixed_slope(surface: Callable[[Any, Any], Any]) -> Any:
    """∂²/∂s∂t at s = t = 0 of a number or matrix along a surface."""
    return slope(lambda s: slope(lambda t: surface(s, t)))


def entries(value: Any) -> list[Any]:
    """The entries of numbers, matrices and lists of them, in order."""
    if hasattr(value, "shape"):
        return list(value)
    if isinstance(value, Iterable):
        return [entry for part in value for entry in entries(part)]
    return [sympify(value)]


def agree(found: Any, wanted: Any) -> bool:
    """Whether two numbers agree to 40 digits, relative to 1 + |wanted|."""
    difference = found - wanted
    if difference == 0:
        return True
    return bool(size(number(difference)) <= EPS * (1 + size(number(wanted))))


def size(value: Any) -> Any:
    """The larger of |Re| and |Im|: rational, as |z| is not."""
    return max(abs(part) for part in value.as_real_imag())


def columns(length: int, build: Callable[[int], Any]) -> Any:
    """The matrix of the columns build(0), …, build(length − 1)."""
    return Matrix.hstack(*[build(index) for index in range(length)])
