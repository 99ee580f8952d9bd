"""Truncated power series in one small quantity, with coefficients of any kind.

A text that `numeric_text` wrote runs on them as it runs on numbers: what a scheme derives once is
so expanded in the step, or differentiated by a start or a parameter, to any order. Coefficients are
floats, columns of r floats, gmpy2's numbers, formulas (`laurent`) or residues (`prime_field`).
Everything that is no `Series` is exact and constant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import TypeAlias

import numpy as np

from ...errors import BadInput
from ...numbers import Arithmetic, PrimeField, sympy
from ...numbers.types import Function, Namespace, Number, Scalar
from .laurent import Atoms, Laurent

Coefficient: TypeAlias = Scalar


class NotKnown(BadInput):
    """A coefficient is asked for beyond those that a series has."""


def _none(e: Coefficient) -> bool:
    """Return whether a coefficient is the integer 0, which is certain and costs no products."""
    return type(e) is int and e == 0


def _vanishes(e: Coefficient) -> bool:
    """Return whether a coefficient, or each number of a column, is zero."""
    return not e.any() if isinstance(e, np.ndarray) else not isinstance(e, Laurent) and e == 0


def _told(answer: bool | np.ndarray) -> bool:
    """Return whether a comparison holds; raise `ValueError` if rows of a column differ."""
    if np.all(answer) == np.any(answer):
        return bool(np.all(answer))
    raise ValueError("rows of a column of series are not alike in a comparison")


class Series:
    """c₀ ε^k + c₁ ε^(k+1) + … + O(ε^end), k = `start`, which may be negative."""

    __slots__ = ("c", "end", "start")
    __array_ufunc__ = None  # numpy leaves sums and products with its arrays to this class

    def __init__(self, c: Sequence[Coefficient], start: int = 0, end: int = 0) -> None:
        first = 0
        while first < len(c) and _none(c[first]):
            first += 1
        self.start, self.end = min(start + first, end), end
        self.c = tuple(c[first : first + max(0, end - self.start)])

    @classmethod
    def variable(cls, terms: int, one: Coefficient = 1.0) -> Series:
        """Return ε, known to so many terms; one: the coefficients' number 1."""
        return cls((one,), 1, terms + 1)

    def coefficient(self, k: int) -> Coefficient:
        """Return the coefficient of ε^k; raise `NotKnown` beyond the last."""
        if k >= self.end:
            raise NotKnown(f"of a series up to the power {self.end - 1} the power {k} is asked.")
        return self.c[k - self.start] if 0 <= k - self.start < len(self.c) else 0

    def _as_series(self, other: Scalar) -> Series:
        return other if isinstance(other, Series) else Series((other,), 0, max(self.end, 1))

    def __add__(self, other: Scalar) -> Series:
        if _none(other):
            return self
        if not isinstance(other, Series):
            other = Series((other,), 0, self.end)
        start, end = min(self.start, other.start), min(self.end, other.end)
        sums = [*[0] * (self.start - start), *self.c][: end - start]
        sums += [0] * (end - start - len(sums))
        for k, e in zip(range(other.start - start, end - start), other.c, strict=False):
            if not _none(e):
                sums[k] = e if _none(sums[k]) else sums[k] + e
        return Series(sums, start, end)

    __radd__ = __add__

    def __neg__(self) -> Series:
        return Series([e if _none(e) else -e for e in self.c], self.start, self.end)

    def __pos__(self) -> Series:
        return self

    def __sub__(self, other: Scalar) -> Series:
        return self + (-other)

    def __rsub__(self, other: Scalar) -> Series:
        return -self + other

    def __mul__(self, other: Scalar) -> Scalar:
        if not isinstance(other, Series):
            if _none(other):
                return 0
            return Series([e if _none(e) else e * other for e in self.c], self.start, self.end)
        start = self.start + other.start
        end = min(self.start + other.end, other.start + self.end)
        products: list[Coefficient] = [0] * min(end - start, len(self.c) + len(other.c) - 1)
        factors = [(j, b) for j, b in enumerate(other.c) if not _none(b)]
        for i, a in enumerate(self.c):
            if _none(a):
                continue
            for j, b in factors:
                if i + j >= len(products):
                    break
                before = products[i + j]
                products[i + j] = a * b if _none(before) else before + a * b
        return Series(products, start, end)

    __rmul__ = __mul__

    def __truediv__(self, other: Scalar) -> Scalar:
        if isinstance(other, Series):
            return _quotient(self, other._led())
        return Series([e if _none(e) else e / other for e in self.c], self.start, self.end)

    def __rtruediv__(self, other: Scalar) -> Scalar:
        led = self._led()
        return _quotient(Series((other,), 0, led.end - led.start), led)

    def __pow__(self, power: Number) -> Scalar:
        if type(power) is int:
            product: Scalar = 1
            for _ in range(abs(power)):
                product = self * product
            return product if power >= 0 else 1 / product
        return _power(self, power, lambda e: e**power)

    def _led(self) -> Series:
        """Return the series without leading zeros; raise `ZeroDivisionError` if all are."""
        first = 0
        while first < len(self.c) and _vanishes(self.c[first]):
            first += 1
        if first == len(self.c):
            raise ZeroDivisionError("a series that is zero as far as it is known")
        return Series(self.c[first:], self.start + first, self.end)

    def constant(self) -> Coefficient:
        """Return the coefficient of ε⁰; raise `ZeroDivisionError` for negative powers."""
        if self.start < 0:
            raise ZeroDivisionError("a function of a series with negative powers")
        return self.coefficient(0)

    def slope(self) -> Series:
        """Return the derivative by ε."""
        return Series(
            [e if _none(e) else (self.start + k) * e for k, e in enumerate(self.c)],
            self.start - 1, self.end - 1,
        )  # fmt: skip

    def primitive(self) -> Series:
        """Return the integral from 0 of a series without negative powers."""
        return Series(
            [e if _none(e) else e / (self.start + k + 1) for k, e in enumerate(self.c)],
            self.start + 1, self.end + 1,
        )  # fmt: skip

    # what a text compares (the size of a chart's coordinate) is told by the constant term

    def __abs__(self) -> Series:
        return self if self >= 0 else -self

    def __lt__(self, other: Scalar) -> bool:
        return _told(self.constant() < other)

    def __le__(self, other: Scalar) -> bool:
        return _told(self.constant() <= other)

    def __gt__(self, other: Scalar) -> bool:
        return _told(self.constant() > other)

    def __ge__(self, other: Scalar) -> bool:
        return _told(self.constant() >= other)


def _quotient(a: Series, b: Series) -> Series:
    terms = min(a.end - a.start, b.end - b.start)
    coefficients = list[Coefficient]()
    first = b.c[0]
    if type(first) is int and not any(isinstance(e, np.ndarray | float) for e in (*a.c, *b.c)):
        first = Fraction(first)  # or a quotient of whole numbers would be rounded
    for k in range(terms):
        left = a.c[k] if k < len(a.c) else 0
        for i in range(1, min(k + 1, len(b.c))):
            if not (_none(b.c[i]) or _none(coefficients[k - i])):
                left = left - b.c[i] * coefficients[k - i]
        coefficients.append(left if _none(left) else left / first)
    return Series(coefficients, a.start - b.start, a.start - b.start + terms)


def _composed(coefficients: Callable[[int], Coefficient], d: Series) -> Scalar:
    """Return Σ coefficients(k) d^k of a series d without a constant term."""
    most = 1 if d.start >= d.end else (d.end - 1) // max(d.start, 1)
    total: Scalar = coefficients(most)
    for k in range(most - 1, -1, -1):
        total = d * total + coefficients(k)
    return total


def _power(a: Series, power: Number, of_number: Callable[[Coefficient], Coefficient]) -> Scalar:
    """Return a^power by the binomial series; of_number: the power of a coefficient."""
    led = a._led()
    raised = led.start * power
    if int(raised) != raised:
        raise ZeroDivisionError("a root of a series that begins with an odd power")
    d = Series((0, *led.c[1:]), 0, led.end - led.start) / led.c[0]
    terms = [power * 0 + 1]
    for k in range(1, led.end - led.start + 1):
        terms.append(terms[-1] * (power - k + 1) / k)
    series = _composed(lambda k: terms[k], d) * of_number(led.c[0])
    return Series(series.c, series.start + int(raised), series.end + int(raised))


def series_functions(
    own: Mapping[str, Function], ratio: Callable[[int, int], Coefficient]
) -> dict[str, Function]:
    """Return functions of numbers and of series, by their names in generated text.

    own: those of the coefficients; ratio: (a, b) → a/b among them.
    """

    def split(x: Series) -> tuple[Coefficient, Series]:
        first = x.constant()
        return first, x if x.start > 0 else Series((0, *x.c[1:]), 0, x.end)

    def cycle(x: Series, sign: int, odd: int) -> Scalar:
        """Return Σ (sign)^(k//2) d^k/k! over k of the parity `odd`: the cosine or the sine."""
        return _composed(
            lambda k: ratio(sign ** (k // 2), math.factorial(k)) if k % 2 == odd else 0, x
        )

    def exp(x: Series) -> Scalar:
        first, d = split(x)
        return _composed(lambda k: ratio(1, math.factorial(k)), d) * own["exp"](first)

    def turned(x: Series, names: tuple[str, str], sign: int) -> tuple[Scalar, Scalar]:
        """Return (cosine, sine) of the circle (sign −1) or the hyperbola (sign 1)."""
        first, d = split(x)
        c, s = (own[name](first) for name in names)
        near, over = cycle(d, sign, 0), cycle(d, sign, 1)
        return near * c + over * (sign * s), near * s + over * c

    def quotient(bottom: Scalar, top: Scalar) -> Scalar:
        return top / bottom

    def log(x: Series) -> Scalar:
        first, d = split(x)
        return _composed(lambda k: ratio((-1) ** (k + 1), k) if k else 0, d / first) + own["log"](
            first
        )

    def integrated(name: str, slope: Callable[[Series], Scalar]) -> Callable[[Series], Scalar]:
        return lambda x: (slope(x) * x.slope()).primitive() + own[name](x.constant())

    def root(x: Series) -> Scalar:
        return _power(x, ratio(1, 2), own["sqrt"])

    def atan2(y: Scalar, x: Scalar) -> Scalar:
        some = y if isinstance(y, Series) else x
        y, x = some._as_series(y), some._as_series(x)
        turning = (x * y.slope() - y * x.slope()) / (x * x + y * y)
        return turning.primitive() + own["atan2"](y.constant(), x.constant())

    circle, hyperbola = ("cos", "sin"), ("cosh", "sinh")
    of_series: dict[str, Function] = {
        "exp": exp, "log": log, "sqrt": root,
        "cos": lambda x: turned(x, circle, -1)[0], "sin": lambda x: turned(x, circle, -1)[1],
        "tan": lambda x: quotient(*turned(x, circle, -1)),
        "cosh": lambda x: turned(x, hyperbola, 1)[0], "sinh": lambda x: turned(x, hyperbola, 1)[1],
        "tanh": lambda x: quotient(*turned(x, hyperbola, 1)),
        "asin": integrated("asin", lambda x: 1 / root(1 - x * x)),
        "acos": integrated("acos", lambda x: -1 / root(1 - x * x)),
        "atan": integrated("atan", lambda x: 1 / (1 + x * x)),
        "atan2": atan2,
    }  # fmt: skip

    def either(name: str, of: Function) -> Function:
        def function(*arguments: Scalar) -> Scalar:
            return (of if any(isinstance(e, Series) for e in arguments) else own[name])(*arguments)

        return function

    return {name: either(name, of) for name, of in of_series.items()}


def series_namespace(numbers: Arithmetic | Atoms | PrimeField) -> Namespace:
    """Return the names that generated text needs to compute on series of one kind of coefficient.

    Of an arithmetic a coefficient may be a column of numbers; it has to be at work.
    """
    if isinstance(numbers, Atoms):
        functions = series_functions(numbers.namespace(), numbers.number)
        return {**functions, "R": numbers.number, "PI": numbers.decimal(sympy.pi),
                "constant": lambda name: numbers.decimal(getattr(sympy, name)),
                "EPS": Fraction(1, 2**53), "array": _array}  # fmt: skip
    plain = numbers.namespace()
    number = plain["R"]
    functions = series_functions(numbers.array_namespace(), lambda a, b: number(a) / b)
    return {**plain, **functions, "array": _array}


def _array(entries: Sequence[Scalar], *shape: int) -> np.ndarray:
    array = np.empty(len(entries), dtype=object)
    array[:] = list(entries)
    return array.reshape(shape)
