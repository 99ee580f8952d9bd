"""Exact numbers: the input of a scene or a caller, as fractions and sympy numbers.

A float is its exact binary value; a string such as "0.1" or "1/10" is one tenth.
"""

from __future__ import annotations

import math
from decimal import Decimal, InvalidOperation
from fractions import Fraction
from numbers import Rational
from types import SimpleNamespace
from typing import Any

import gmpy2
import mpmath
import sympy
from mpmath.libmp import from_man_exp

from discmech.integrators.scene import refuse_unwritten

from ..failures import ReferenceFailure, shown

FARTHEST = 1000  # largest decimal exponent: larger powers of ten would be written out


def exact_time(t: Any) -> Fraction:
    """Return the time as a fraction; refuses anything but a finite real number."""
    if isinstance(t, float) and not math.isfinite(t):
        raise ReferenceFailure(f"the time t={t} is not finite; give a finite number of seconds")
    if isinstance(t, bool):
        raise ReferenceFailure(f"the time t={t} is a truth value; give a finite number")
    if isinstance(t, str) and _magnitude(t) > FARTHEST:
        raise ReferenceFailure(
            f"the number {t[:40]} lies beyond 10^±{FARTHEST}; choose units in which it does not"
        )
    try:
        # numpy's short floats and gmpy2's are no Rational; numpy's integers stay in a Fraction
        time = Fraction(t if isinstance(t, (Rational, str)) else Fraction(*t.as_integer_ratio()))
        return Fraction(int(time.numerator), int(time.denominator))
    except (ArithmeticError, AttributeError, TypeError, ValueError):
        raise ReferenceFailure(
            f"the time t={shown(t)} is not an exact finite number; "
            'give an int, a Fraction, a float or a decimal string such as "0.1"'
        ) from None


def _magnitude(text: str) -> int:
    """Return |decimal exponent| if the text is a decimal number, else 0."""
    try:
        return abs(Decimal(text).adjusted())
    except InvalidOperation:
        return 0


def exact_number(value: Any, where: str, real: bool = True) -> sympy.Expr:
    """Return the value as an exact sympy number; ``where`` names it in the error."""
    if isinstance(value, (sympy.Expr, complex)):
        number = without_floats(sympy.sympify(value))
    else:
        try:
            fraction = exact_time(value)
        except ReferenceFailure:
            raise ReferenceFailure(
                f"{where} = {shown(value)} is not an exact finite number; "
                "give an int, a Fraction, a float, a decimal string or a sympy number"
            ) from None
        number = sympy.Rational(fraction.numerator, fraction.denominator)
    if number.free_symbols or number.is_finite is False or (real and number.is_real is False):
        kind = "finite real" if real else "finite"
        raise ReferenceFailure(f"{where} = {shown(value)} is not a {kind} number; give one")
    return number


def exact_array(value: Any, where: str, real: bool = True) -> Any:
    """Return a scalar as a sympy number, a list as a column matrix, a nested list as a matrix."""
    if isinstance(value, (tuple, list)):
        rows = [
            [exact_number(entry, where, real) for entry in row]
            if isinstance(row, (tuple, list))
            else [exact_number(row, where, real)]
            for row in value
        ]
        return sympy.Matrix(rows)
    if isinstance(value, sympy.MatrixBase):
        return sympy.Matrix(value).applyfunc(lambda entry: exact_number(entry, where, real))
    return exact_number(value, where, real)


def parameter_values(scene: Any) -> SimpleNamespace:
    """Return the parameters of a scene as a namespace of exact sympy numbers and matrices."""
    return SimpleNamespace(
        **{
            name: exact_array(value, f"parameter {name} of scene {scene.name}")
            for name, value in scene.parameters.items()
        }
    )


def without_floats(expression: sympy.Expr) -> sympy.Expr:
    """Return the expression with each floating-point number replaced by its exact binary value.

    Raises `BadInput` for one with too many digits.
    """
    refuse_unwritten(expression, "what a reference is asked of")
    return expression.xreplace({f: sympy.Rational(f) for f in expression.atoms(sympy.Float)})


def to_mpf(value: Any) -> mpmath.mpf:
    """Return an mpfr number as an mpf, exactly (for any precision of mpmath)."""
    if value == 0:
        return mpmath.mpf(0)
    mantissa, exponent = value.as_mantissa_exp()
    return mpmath.mp.make_mpf(from_man_exp(int(mantissa), int(exponent)))


def number_to_mpf(number: sympy.Expr) -> mpmath.mpf:
    """Return an exact sympy number as an mpf at mpmath's working precision."""
    if number.is_Rational:
        return mpmath.mpf(int(number.p)) / int(number.q)
    return mpmath.mpf(_decimals(number, mpmath.mp.dps + 10))


def is_short(number: sympy.Expr) -> bool:
    """Return True for a short integer, which is shorter to write and faster in a product."""
    return number.is_Integer and abs(int(number)) < 2**31


def number_to_mpfr(number: sympy.Expr, digits: int) -> Any:
    """Return an exact sympy number as an mpfr at the current gmpy2 precision, or an int."""
    if is_short(number):
        return int(number)
    if number.is_Rational:
        return gmpy2.mpfr(gmpy2.mpq(int(number.p), int(number.q)))
    return gmpy2.mpfr(_decimals(number, digits + 10))


def _decimals(number: sympy.Expr, digits: int) -> str:
    """Return the decimals of a real number; raises `ReferenceFailure` for any other."""
    value = number.evalf(digits)
    if not value.is_Float and not value.is_Rational:
        raise ReferenceFailure(f"{number} is no real number: write the scene without it")
    return str(value)
