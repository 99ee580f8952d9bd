"""The two kinds of number on which a flow runs: double precision, and any number of digits.

High precision computes on gmpy2 numbers (nine times faster than mpmath's own) with guard digits,
and returns mpmath numbers. Each kind is one class, with equal members; no other code asks which.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from fractions import Fraction
from functools import cache
from types import ModuleType
from typing import TypeAlias

import numpy as np

from ..errors import BadInput, shown
from .exact import exact
from .lazy import LazyModule, sympy
from .types import DType, Exact, Expression, Function, Matrix, Mpf, Namespace, Number, Numbers

#: digits computed beyond the requested ones: a run loses fewer by cancellation
MOST_DIGITS = 10_000
GUARD_DIGITS = 12

#: sympy function → its name in generated text; math, numpy and gmpy2 have each (abs is built in)
FUNCTIONS = {
    "sin": "sin", "cos": "cos", "tan": "tan", "asin": "asin", "acos": "acos", "atan": "atan",
    "atan2": "atan2", "sinh": "sinh", "cosh": "cosh", "tanh": "tanh", "exp": "exp", "log": "log",
    "Abs": "abs",
}  # fmt: skip


class NotComputed(BadInput):
    """No arithmetic has the function of an expression."""


class NotSmooth(NotComputed):
    """An expression is the derivative of one that is not differentiable everywhere."""


def finite(values: np.ndarray) -> np.ndarray:
    """Return for each number of an array, of any arithmetic, whether it is finite."""
    if values.dtype == object:
        return np.asarray(values - values == 0)
    return np.isfinite(values)


def refused(e: Expression) -> NotComputed:
    """Return the error for an expression that no arithmetic has, named by its function."""
    name = type(e).__name__
    what = f"the function {name}" if e.is_Function else f"the expression {e} ({name})"
    if name in ("Derivative", "Subs"):  # Subs: a derivative at another point
        name = type((e if name == "Derivative" else e.args[0]).args[0]).__name__
        what = f"the derivative of {name}"
    if name in ("sign", "Heaviside", "DiracDelta"):
        return NotSmooth(
            "the derivative of Abs (of Max, Min, a step) cannot be put into a kernel: write the "
            "Lagrangian, the force, the constraints, the gaps and the rule without Abs and the "
            "like (the root of a square is one too)."
        )
    known = ", ".join(FUNCTIONS)
    return NotComputed(f"{what} cannot be put into a kernel; there are {known}, powers and roots.")


def _functions(library: ModuleType | LazyModule, **others: str) -> dict[str, Function]:
    """Return a library's functions by their names in generated text; `others`: its other names."""
    names = {*FUNCTIONS.values(), "sqrt"} - {"abs"}
    return {name: getattr(library, others.get(name, name)) for name in names}


class Double:
    """IEEE double precision; exact numbers are rounded once."""

    digits, bits = 16, 53
    eps: Number = 2.0**-53
    dtype: DType = np.float64

    def namespace(self) -> Namespace:
        """Return the names that generated text needs: functions, the number type R, constants."""
        return {**_functions(math), "R": float, "PI": math.pi, "constant": self.constant,
                "EPS": self.eps, "ROOT_EPS": 2.0**-26, "HUGE": 1e300, "DECAY": 0.999,
                "MARGIN": 8.0,
                "array": self.array, **self.matrices()}  # fmt: skip

    def matrices(self: Arithmetic) -> dict[str, Function]:
        """Return functions of generated text for N×N matrices: each writes into `out`."""

        def product(out: Matrix, a: Matrix, b: Matrix) -> None:
            out[...] = a @ b if self.dtype is not object else _product(a, b)

        def quotient(out: Matrix, a: Matrix, b: Matrix) -> None:
            out[...] = self.solve(a, b)

        return {"zeros": self.zeros, "matrix_product": product, "matrix_quotient": quotient}

    def array_namespace(self) -> Namespace:
        """Return the names with which generated text computes on columns of numbers, by numpy."""

        def array(entries: Numbers, *shape: int) -> np.ndarray:
            each = [np.asarray(entry) for entry in entries]
            of_each = np.broadcast_shapes(*(e.shape for e in each))  # a constant is one number
            kind = np.result_type(*each) if each else float  # also numbers of mpmath
            rows = np.empty((len(each), *of_each), kind)
            for k, entry in enumerate(each):
                rows[k] = entry
            return rows.reshape(*shape, *of_each)

        functions = _functions(np, asin="arcsin", acos="arccos", atan="arctan", atan2="arctan2")
        return {**functions, "R": float, "PI": math.pi, "constant": self.constant,
                "array": array}  # fmt: skip

    def number(self, value: Exact | Number, what: str = "value") -> Number:
        """Return an exact value, float or mpf as a number of this kind."""
        if type(value) is float and math.isfinite(value):
            return value  # most values are floats: a run should not start with fractions of them
        number = exact(value, what)
        try:
            return float(number)
        except OverflowError:
            raise BadInput(
                f"{what} is larger than any double: choose units that fit the motion."
            ) from None

    def constant(self: Arithmetic, name: str) -> Number:
        """Return a number that sympy knows by that name: GoldenRatio, EulerGamma, Catalan, …"""
        return self.number(getattr(sympy, name))

    def working(self) -> AbstractContextManager[object]:
        """Return the context for computing in this arithmetic."""
        return np.errstate(all="ignore")

    #: the context for code of a user, who computes with public numbers
    user_working = working

    def public(self, array: Numbers) -> np.ndarray:
        """Return an array in the form that the user gets: of floats, or of mpmath's numbers."""
        return np.asarray(array, dtype=np.float64)

    def array(self: Arithmetic, entries: Numbers, *shape: int) -> np.ndarray:
        """Return an array of that shape from the entries, row by row."""
        return np.array(entries, dtype=self.dtype).reshape(shape)

    def own(self: Arithmetic, values: Numbers) -> np.ndarray:
        """Return an array of exact or any other numbers as one of this kind."""
        if isinstance(values, np.ndarray) and values.dtype == self.dtype != object:
            return values
        entries = np.asarray(values, dtype=object)
        numbers = np.array([self.number(e) for e in entries.flat], dtype=self.dtype)
        return numbers.reshape(entries.shape)

    def multiples(self, step: Fraction, index: np.ndarray) -> np.ndarray:
        """Return step·k for whole numbers k, each rounded once."""
        top, bottom = step.numerator, step.denominator
        largest = max(int(index[-1]), 1) if len(index) else 0
        if largest and abs(top) * largest < 2**53 and bottom < 2**53:
            return np.asarray(index * top / bottom)
        return np.array([int(k) * top / bottom for k in index])  # / of integers rounds once

    def zeros(self, *shape: int) -> np.ndarray:
        """Return an array of zeros of this kind."""
        return np.zeros(shape)

    def identity(self: Arithmetic, size: int) -> Matrix:
        """Return the identity matrix of this kind."""
        return self.zeros(size, size) + np.eye(size, dtype=int)

    def det(self, a: Matrix) -> Number:
        """Return the determinant."""
        return np.linalg.det(a)

    def solve(self, a: Matrix, b: np.ndarray) -> np.ndarray:
        """Return a⁻¹ b; raises `ZeroDivisionError` if a is singular."""
        try:
            return np.asarray(np.linalg.solve(a, b))
        except np.linalg.LinAlgError:
            raise ZeroDivisionError("singular matrix") from None


class Single(Double):
    """IEEE single precision, for runs of flows: numpy's float32 rounds each operation."""

    digits, bits = 7, 24
    eps: Number = 2.0**-24
    dtype: DType = np.float32

    def namespace(self) -> Namespace:
        functions = self.array_namespace()
        return {**super().namespace(), **functions, "EPS": np.float32(self.eps),
                "ROOT_EPS": np.float32(2.0**-12), "HUGE": np.float32(1e30),
                "array": self.array}  # fmt: skip

    def array_namespace(self) -> Namespace:
        return {**super().array_namespace(), "R": np.float32, "PI": np.float32(math.pi)}

    def number(self, value: Exact | Number, what: str = "value") -> Number:
        real = np.float32(super().number(float(value) if isinstance(value, np.floating) else value,
                                         what))  # fmt: skip
        if not np.isfinite(real):
            raise BadInput(f"{what} is larger than any number of single precision.")
        return real

    def public(self, array: Numbers) -> np.ndarray:
        return np.asarray(array, dtype=np.float32)

    def zeros(self, *shape: int) -> np.ndarray:
        return np.zeros(shape, dtype=np.float32)

    def identity(self: Arithmetic, size: int) -> Matrix:
        return np.eye(size, dtype=np.float32)


class Multiple:
    """Any number of decimal digits, with guard digits, on gmpy2's binary floating point."""

    dtype: DType = object
    # these need only dtype, zeros, number, solve
    array, identity, matrices = Double.array, Double.identity, Double.matrices
    constant, own = Double.constant, Double.own

    def __init__(self, digits: int) -> None:
        import gmpy2

        self.digits, self._gmpy2 = digits, gmpy2
        self.bits = math.ceil((digits + GUARD_DIGITS) * math.log2(10))
        with self.working():
            self.eps: Number = gmpy2.mpfr(2) ** -self.bits
            self.imaginary_unit: Number = gmpy2.mpc(0, 1)

    def namespace(self) -> Namespace:
        g = self._gmpy2
        with self.working():
            return {**_functions(g), "R": g.mpfr, "PI": g.const_pi(), "constant": self.constant,
                    "EPS": self.eps, "ROOT_EPS": g.sqrt(self.eps),
                    "HUGE": g.mpfr("1e300"), "DECAY": g.mpfr("0.999"),
                    "MARGIN": g.mpfr(2) ** 40,
                    "array": self.array, **self.matrices()}  # fmt: skip

    def array_namespace(self) -> Namespace:
        """Return what generated text needs to compute on whole columns, entry by entry."""
        own = {name: np.frompyfunc(f, 1 + (name == "atan2"), 1)
               for name, f in _functions(self._gmpy2).items()}  # fmt: skip
        return {**self.namespace(), **own, "array": Double().array_namespace()["array"]}

    def number(self, value: Exact | Number, what: str = "value") -> Number:
        if isinstance(value, type(self._gmpy2.mpfr(0))):
            return value
        if isinstance(value, float) and math.isfinite(value):
            return self._gmpy2.mpfr(float(value))  # a run's rows should not start with fractions
        value = exact(value, what)
        if isinstance(value, Fraction):
            return self._gmpy2.mpfr(self._gmpy2.mpq(value.numerator, value.denominator))
        return self._gmpy2.mpfr(str(value.evalf(self.digits + GUARD_DIGITS + 5)))

    @contextmanager
    def working(self) -> Iterator[None]:
        with self._gmpy2.context(self._gmpy2.context(), precision=self.bits):
            yield

    @contextmanager
    def user_working(self) -> Iterator[None]:
        import mpmath  # all threads share its precision, so our own kernels do not set it

        with self.working(), mpmath.workprec(self.bits):
            yield

    def public(self, array: Numbers) -> np.ndarray:
        return np.vectorize(self._mpf, otypes=[object])(np.asarray(array, dtype=object))

    def _mpf(self, value: Number) -> Mpf:
        import mpmath

        value = self._gmpy2.mpfr(value)
        if not self._gmpy2.is_finite(value):
            return mpmath.mpf(str(value))
        mantissa, exponent = value.as_mantissa_exp()
        return mpmath.mp.make_mpf(mpmath.libmp.from_man_exp(int(mantissa), int(exponent)))

    def multiples(self, step: Fraction, index: np.ndarray) -> np.ndarray:
        return np.array([self.number(step * int(k)) for k in index], dtype=object)

    def zeros(self, *shape: int) -> np.ndarray:
        return np.full(shape, self._gmpy2.mpfr(0), dtype=object)

    def det(self, a: Matrix) -> Number:
        return self._eliminated(a, a[:, :0])[0]

    def solve(self, a: Matrix, b: np.ndarray) -> np.ndarray:
        det, solution = self._eliminated(a, np.atleast_2d(np.transpose(b)).T)
        if det == 0:
            raise ZeroDivisionError("singular matrix")
        return solution.reshape(np.shape(b))

    def _eliminated(self, a: Matrix, b: Matrix) -> tuple[Number, Matrix]:
        """Return (det a, a⁻¹ b) with row exchanges, b a matrix; (0, useless) if a is singular."""
        one = self._gmpy2.mpfr(1)  # integers among the entries would be divided as floats
        rows = [[e * one for e in (*left, *right)] for left, right in zip(a, b, strict=True)]
        size, det = len(rows), one
        for p in range(size):
            best = max(range(p, size), key=lambda row: abs(rows[row][p]))
            if best != p:
                det, rows[p], rows[best] = -det, rows[best], rows[p]
            lead = rows[p]
            pivot = lead[p]
            det = det * pivot
            if pivot == 0:
                return det, b
            some = [(i, lead[i]) for i in range(p + 1, len(lead)) if lead[i]]  # many are zeros
            for row in rows[p + 1 :]:
                if row[p]:
                    factor = row[p] / pivot
                    for i, e in some:
                        row[i] -= factor * e
        answer = [row[size:] for row in rows]
        for p in reversed(range(size)):  # only now, with b alone: half as many products
            for k in range(p + 1, size):
                if factor := rows[p][k]:
                    answer[p] = [e - factor * f for e, f in zip(answer[p], answer[k], strict=True)]
            answer[p] = [e / rows[p][p] for e in answer[p]]
        return det, np.array(answer, dtype=object).reshape(b.shape)


def _product(a: Matrix, b: Matrix) -> Matrix:
    """Return a·b, N×N, of objects: half of the work where both have a block of zeros on the lower
    left, as the matrices have of which functions are differentiated."""
    n = len(a) // 2
    if len(a) % 2 or a[n:, :n].any() or b[n:, :n].any():
        return np.asarray(a @ b)
    corner = _product(a[:n, :n], b[:n, n:]) + _product(a[:n, n:], b[n:, n:])
    top = _product(a[:n, :n], b[:n, :n]), corner
    return np.block([[*top], [a[n:, :n], _product(a[n:, n:], b[n:, n:])]])


#: the kinds of number; `Single` is a `Double` of fewer bits
Arithmetic: TypeAlias = Double | Multiple


@cache
def _of_digits(digits: int) -> Arithmetic:
    if digits == Single.digits:
        return Single()
    return Double() if digits == Double.digits else Multiple(digits)


def arithmetic(digits: int, single: bool = False) -> Arithmetic:
    """Return the arithmetic of that many decimal digits; 16 is double precision.

    single: True if 7, single precision, may be asked for: it is for flows alone.
    """
    if single and type(digits) is int and digits == Single.digits:
        return _of_digits(digits)
    if type(digits) is not int or not 16 <= digits <= MOST_DIGITS:
        raise BadInput(
            f"digits is {shown(digits)}: give 16 (double precision) or a larger whole number, "
            f"up to {MOST_DIGITS}{', or 7 (single precision)' * single}."
        )
    return _of_digits(digits)
