"""The two kinds of number a flow runs on: double precision, and any number of digits.

High precision computes on gmpy2 numbers (nine times faster than mpmath's own) with guard digits,
and hands out mpmath numbers. One class each, same members; nothing else knows which it has.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from functools import cache
from typing import Any, TypeAlias

import numpy as np

from ..errors import BadInput
from .exact import exact

GUARD_DIGITS = 12

#: sympy function → its name in generated text; math, numpy and gmpy2 have each (abs is built in)
FUNCTIONS = {
    "sin": "sin", "cos": "cos", "tan": "tan", "asin": "asin", "acos": "acos", "atan": "atan",
    "atan2": "atan2", "sinh": "sinh", "cosh": "cosh", "tanh": "tanh", "exp": "exp", "log": "log",
    "Abs": "abs",
}  # fmt: skip


class Double:
    """IEEE double precision; exact numbers are rounded once."""

    digits = 16
    eps = 2.0**-53
    dtype: Any = np.float64

    def namespace(self) -> dict[str, Any]:
        """What generated text needs: functions, the number type R, constants."""
        functions = {n: getattr(math, n) for n in FUNCTIONS.values() if n != "abs"}
        return {**functions, "sqrt": math.sqrt, "R": float, "PI": math.pi,
                "EPS": self.eps, "ROOT_EPS": 2.0**-26, "HUGE": 1e300, "DECAY": 0.999,
                "zeros": self.zeros, "linear_solve": self.solve, "array": self.array}  # fmt: skip

    def array_namespace(self) -> dict[str, Any]:
        """What generated text needs to compute on whole columns of numbers: numpy's functions."""

        def array(entries: Any, *shape: int) -> np.ndarray:
            rows = np.array(np.broadcast_arrays(*entries))  # a constant entry is one number
            return rows.reshape(*shape, *rows.shape[1:])

        names = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "atan2": "arctan2"}
        functions = {n: getattr(np, names.get(n, n)) for n in FUNCTIONS.values() if n != "abs"}
        return {**functions, "sqrt": np.sqrt, "R": float, "PI": math.pi, "array": array}

    def number(self, value: Any, what: str = "value") -> Any:
        """An exact value, float or mpf as a number of this kind."""
        if type(value) is float and math.isfinite(value):
            return value  # most are: a run should not start with fractions of them
        return float(exact(value, what))

    @contextmanager
    def working(self) -> Iterator[None]:
        """Context in which the arithmetic is done."""
        with np.errstate(all="ignore"):
            yield

    def public(self, array: Any) -> Any:
        """An array as handed to the user."""
        return np.asarray(array, dtype=np.float64)

    def array(self, entries: Any, *shape: int) -> np.ndarray:
        """An array of that shape from the entries, row by row."""
        return np.array(entries, dtype=np.float64).reshape(shape)

    def multiples(self, step: Fraction, index: np.ndarray) -> np.ndarray:
        """step·k for whole numbers k, each rounded once."""
        top, bottom = step.numerator, step.denominator
        if len(index) and abs(top) * int(index[-1]) < 2**53 and bottom < 2**53:
            return np.asarray(index * top / bottom)
        return np.array([float(step * int(k)) for k in index])

    def zeros(self, *shape: int) -> np.ndarray:
        """An array of zeros of this kind."""
        return np.zeros(shape)

    def identity(self, size: int) -> np.ndarray:
        """The identity matrix of this kind."""
        return np.eye(size)

    def det(self, a: np.ndarray) -> Any:
        """The determinant."""
        return np.linalg.det(a)

    def solve(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """a⁻¹ b; raises `ZeroDivisionError` if a is singular."""
        try:
            return np.asarray(np.linalg.solve(a, b))
        except np.linalg.LinAlgError:
            raise ZeroDivisionError("singular matrix") from None


class Multiple:
    """Any number of decimal digits, with guard digits, on gmpy2's binary floating point."""

    dtype: Any = object

    def __init__(self, digits: int) -> None:
        self.digits = digits
        self.bits = math.ceil((digits + GUARD_DIGITS) * math.log2(10))
        import gmpy2

        self._gmpy2 = gmpy2
        with self.working():
            self.eps = gmpy2.mpfr(2) ** -self.bits
            self.imaginary_unit = gmpy2.mpc(0, 1)

    def namespace(self) -> dict[str, Any]:
        g = self._gmpy2
        functions = {n: getattr(g, n) for n in FUNCTIONS.values() if n != "abs"}
        with self.working():
            return {**functions, "sqrt": g.sqrt, "R": g.mpfr, "PI": g.const_pi(),
                    "EPS": self.eps, "ROOT_EPS": g.sqrt(self.eps),
                    "HUGE": g.mpfr("1e300"), "DECAY": g.mpfr("0.999"),
                    "workspace": lambda rows, columns: [[g.mpfr(0)] * columns for _ in range(rows)],
                    "zeros": self.zeros, "linear_solve": self.solve,
                    "array": self.array}  # fmt: skip

    def number(self, value: Any, what: str = "value") -> Any:
        if isinstance(value, type(self._gmpy2.mpfr(0))):
            return value
        value = exact(value, what)
        if isinstance(value, Fraction):
            return self._gmpy2.mpfr(self._gmpy2.mpq(value.numerator, value.denominator))
        return self._gmpy2.mpfr(str(value.evalf(self.digits + GUARD_DIGITS + 5)))

    @contextmanager
    def working(self) -> Iterator[None]:
        with self._gmpy2.context(self._gmpy2.context(), precision=self.bits):
            yield

    def public(self, array: Any) -> Any:
        array = np.asarray(array, dtype=object)
        out = np.empty(array.shape, dtype=object)
        for index, value in np.ndenumerate(array):
            out[index] = self._mpf(value)
        return out

    def _mpf(self, value: Any) -> Any:
        import mpmath

        value = self._gmpy2.mpfr(value)
        if not self._gmpy2.is_finite(value):
            return mpmath.mpf(str(value))
        mantissa, exponent = value.as_mantissa_exp()
        return mpmath.mp.make_mpf(mpmath.libmp.from_man_exp(int(mantissa), int(exponent)))

    def array(self, entries: Any, *shape: int) -> np.ndarray:
        return np.array(entries, dtype=object).reshape(shape)

    def multiples(self, step: Fraction, index: np.ndarray) -> np.ndarray:
        return np.array([self.number(step * int(k)) for k in index], dtype=object)

    def zeros(self, *shape: int) -> np.ndarray:
        return np.full(shape, self._gmpy2.mpfr(0), dtype=object)

    def identity(self, size: int) -> np.ndarray:
        return self.zeros(size, size) + np.eye(size, dtype=int)

    def det(self, a: np.ndarray) -> Any:
        return self._gauss_jordan(a, a[:, :0])[0]

    def solve(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        det, solution = self._gauss_jordan(a, np.atleast_2d(np.transpose(b)).T)
        if det == 0:
            raise ZeroDivisionError("singular matrix")
        return solution.reshape(np.shape(b))

    def _gauss_jordan(self, a: np.ndarray, b: np.ndarray) -> tuple[Any, np.ndarray]:
        """(det a, a⁻¹ b) with row exchanges, b a matrix; (0, nothing of use) if a is singular."""
        a, b, det = a.copy(), b.astype(object), self._gmpy2.mpfr(1)
        for p in range(len(a)):
            row = p + int(np.argmax(abs(a[p:, p])))
            if row != p:
                det = -det
                for matrix in (a, b):
                    matrix[[p, row]] = matrix[[row, p]]
            det = det * a[p, p]
            if a[p, p] == 0:
                break
            b[p], a[p] = b[p] / a[p, p], a[p] / a[p, p]
            factors = a[:, p].copy()
            factors[p] = self._gmpy2.mpfr(0)
            a, b = a - np.outer(factors, a[p]), b - np.outer(factors, b[p])
        return det, b


#: the two kinds of number
Arithmetic: TypeAlias = Double | Multiple


def arithmetic(digits: int) -> Arithmetic:
    """The arithmetic of that many decimal digits; 16 is double precision."""
    if type(digits) is not int or digits < 16:
        raise BadInput(
            f"digits is {digits!r}: give 16 (double precision) or a larger whole number."
        )
    return _arithmetic(digits)


@cache
def _arithmetic(digits: int) -> Arithmetic:
    return Double() if digits == 16 else Multiple(digits)
