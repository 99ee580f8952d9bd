"""Running error analysis by ball arithmetic: numbers that carry a bound of their round-off.

Beside the values of an arithmetic stand balls of python-flint with as many bits, on which the same
operations run: the radius of a ball, in units ε of round-off, bounds how far an evaluation in that
arithmetic is off (Johansson, Arb: efficient arbitrary-precision midpoint-radius interval
arithmetic, 2017). Cancellation, the conditioning of every function, and units of length, time and
mass are included. Values are those of the arithmetic itself; balls are computed when a bound is
first used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cache, cached_property, partial
from typing import Any

import numpy as np

from .arithmetic import FUNCTIONS, Arithmetic
from .lazy import LazyModule
from .numeric import run_text
from .registered import registered_names
from .types import Array, Ball, DType, Function, Namespace, Number, Numbers, Vector

flint = LazyModule("flint")
gmpy2 = LazyModule("gmpy2")


class Tracked:
    """An array of numbers with the balls that the same operations give.

    It goes through numpy's functions that only move entries (stack, block, transpose) and through
    @, +, −, *, / and `solve`. balls: the object array of balls; without it the numbers are exact.
    """

    __array_ufunc__ = None  # a plain array leaves its operators to this class

    def __init__(self, value: np.ndarray, balls: Callable[[], np.ndarray] | None = None) -> None:
        self.value, self._balls, self.bits = value, balls, bits_of(value)

    @cached_property
    def balls(self) -> np.ndarray:
        """The balls, of the value's shape."""
        balls = exact_balls(self.value) if self._balls is None else self._balls()
        return np.asarray(balls, dtype=object)

    @cached_property
    def error(self) -> np.ndarray:
        """The bounds, of the value's shape, in units of round-off; nan where there is none."""
        unit = 2**self.bits
        return self._numbers([ball.rad() * unit for ball in self.balls.flat])

    def _numbers(self, balls: Iterable[Ball]) -> np.ndarray:
        """Return the middles of balls as numbers of the value's kind; nan where one is not finite.

        An infinite bound would excuse any gap.
        """
        kind = self.value.dtype if self.value.dtype.kind in "fO" else np.dtype(float)
        return np.array(plain(balls, kind), kind).reshape(np.shape(self.value))

    def __array_function__(
        self, function: Function, types: object, arguments: Sequence[Any], more: Namespace
    ) -> Tracked:
        values = _each(arguments, lambda e: tracked(e).value)
        return Tracked(
            function(*values, **more),
            lambda: function(*_each(arguments, lambda e: tracked(e).balls), **more),
        )

    def __matmul__(self, other: Array) -> Tracked:
        # a ball that contains 0 is no zero: its error counts
        return _both(product, self, other, on_balls=np.matmul)

    def __rmatmul__(self, other: Array) -> Tracked:
        return tracked(other) @ self

    def __add__(self, other: Array) -> Tracked:
        return _both(np.add, self, other)

    def __sub__(self, other: Array) -> Tracked:
        return _both(np.subtract, self, other)

    def __mul__(self, number: Array) -> Tracked:
        return _both(np.multiply, self, number)

    def __truediv__(self, number: Array) -> Tracked:
        return _both(np.divide, self, number)

    def __neg__(self) -> Tracked:
        return _both(np.negative, self)

    def __rsub__(self, other: Array) -> Tracked:
        return -self + other

    def __getitem__(self, place: int | slice | np.ndarray | tuple[int | slice, ...]) -> Tracked:
        return Tracked(self.value[place], lambda: self.balls[place])

    @property
    def T(self) -> Tracked:
        """The transpose."""
        return Tracked(self.value.T, lambda: self.balls.T)

    @property
    def shape(self) -> tuple[int, ...]:
        """The array's shape."""
        return self.value.shape

    __radd__, __rmul__ = __add__, __mul__


def _both(operation: Function, *parts: Array, on_balls: Function | None = None) -> Tracked:
    """Return the result of an operation on values, and on balls once they are used."""
    operands = [tracked(part) for part in parts]
    value = np.asarray(operation(*(part.value for part in operands)))
    bits = bits_of(value)

    def balls() -> np.ndarray:
        with flint.ctx.workprec(bits):
            return (on_balls or operation)(*(part.balls for part in operands))

    return Tracked(value, balls)


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a @ b; with many digits products with 0 cost as much, so zeros of b are left out."""
    if a.dtype != object or b.ndim < 2 or b.all():
        return np.asarray(a @ b)
    result = np.empty((*a.shape[:-1], b.shape[1]), dtype=object)
    for column, used in enumerate((b != 0).T):
        result[..., column] = a[..., used] @ b[used, column]
    return result


def bits_of(array: np.ndarray) -> int:
    """Return the bits of the arithmetic that is computing with an array."""
    if array.dtype == object:
        return int(gmpy2.get_context().precision)
    return 1 + int(np.finfo(array.dtype).nmant) if array.dtype.kind == "f" else 53


def exact_balls(array: np.ndarray) -> np.ndarray:
    """Return the numbers of an array as balls of radius 0."""
    balls = np.empty(np.shape(array), dtype=object)
    balls[...] = np.reshape([_ball(e) for e in array.flat], balls.shape)
    return balls


def _ball(number: Number) -> Ball:
    """Return a number of numpy, gmpy2 or Python as a ball of radius 0."""
    if not hasattr(number, "as_mantissa_exp"):
        return flint.arb(number.item() if isinstance(number, np.generic) else number)
    if not number or number - number != 0:
        return flint.arb(float(number))
    mantissa, exponent = number.as_mantissa_exp()
    return flint.arb((int(mantissa), int(exponent)))


def plain(balls: Iterable[Ball], dtype: DType) -> list[Number]:
    """Return the middles of balls as doubles, or as gmpy2's numbers for objects."""
    if np.dtype(dtype) != np.dtype(object):
        return [float(ball) if ball.is_finite() else np.nan for ball in balls]
    return list(map(_of_gmpy2, balls))


def _of_gmpy2(ball: Ball) -> Number:
    if not ball.is_finite():
        return gmpy2.nan()
    mantissa, exponent = ball.mid().man_exp()
    return gmpy2.mpfr(int(mantissa)) * gmpy2.mpfr(2) ** int(exponent)


def _each(nested: Any, change: Callable[[Array], np.ndarray]) -> Any:
    if isinstance(nested, list | tuple):
        return [_each(e, change) for e in nested]
    return change(nested) if isinstance(nested, np.ndarray | Tracked) else nested


def tracked(array: Array) -> Tracked:
    """Return an array, or a number, as `Tracked`; plain numbers are exact."""
    return array if isinstance(array, Tracked) else Tracked(np.asarray(array))


def tracked_later(
    values: Iterable[Vector], again: Callable[[], Iterable[Tracked]]
) -> list[Tracked]:
    """Return arrays as `Tracked`, with the balls of `again()`: the same ones, `Tracked`."""
    once = cache(lambda: list(again()))
    return [Tracked(e, partial(lambda k: once()[k].balls, k)) for k, e in enumerate(values)]


def rounded(values: Numbers | Number, errors: Numbers | Number | None = None) -> Tracked:
    """Return numbers with errors in units of round-off, by default one rounding each."""
    values = np.asarray(values)
    errors = abs(values) if errors is None else np.broadcast_to(errors, values.shape)
    bits = bits_of(values)

    def balls() -> np.ndarray:
        unit = flint.arb(2) ** -bits
        entries = np.empty(values.shape, dtype=object)
        pairs = zip(exact_balls(values).flat, exact_balls(np.asarray(errors)).flat, strict=True)
        entries[...] = np.reshape([flint.arb(v, unit * e) for v, e in pairs], entries.shape)
        return entries

    return Tracked(values, balls)


def solve(numbers: Arithmetic, a: Array, b: Array) -> Array:
    """Return a⁻¹ b of plain or tracked arrays (`Arithmetic.solve`); a is k×k, b has k rows."""
    if not isinstance(a, Tracked) and not isinstance(b, Tracked):
        return numbers.solve(a, b)
    a, b = tracked(a), tracked(b)
    x = numbers.solve(a.value, b.value)
    bits = bits_of(x)

    def balls() -> np.ndarray:
        with flint.ctx.workprec(bits):
            return _solved(a.balls, b.balls)

    return Tracked(x, balls)


def _solved(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a⁻¹ b of balls; nan if a may be singular within its balls."""
    right = flint.arb_mat(np.reshape(b, (len(b), -1)).tolist())
    try:
        entries = flint.arb_mat(a.tolist()).solve(right).entries() if b.size else []
    except ZeroDivisionError:
        entries = [flint.arb.nan()] * b.size
    solution = np.empty(b.shape, dtype=object)
    solution[...] = np.array(entries, dtype=object).reshape(b.shape)
    return solution


def inverse_sizes(a: np.ndarray) -> np.ndarray:
    """Return |a⁻¹| of a k×k matrix; raises `ZeroDivisionError` if it is singular.

    It is computed with twice the digits, so that a matrix of any condition has one.
    """
    if not len(a):
        return a
    with flint.ctx.workprec(2 * bits_of(a) + 64):
        inverse = flint.arb_mat(exact_balls(a).tolist()).inv().entries()
    return abs(np.array(plain(inverse, a.dtype), a.dtype).reshape(a.shape))


def with_running_errors(text: str, numbers: Arithmetic) -> Function:
    """Return the function of a text that `numeric_text` wrote, of numbers with errors.

    It takes plain and `Tracked` arrays and numbers, and returns `Tracked` arrays. Functions before
    it (series, functions of matrices) count as one operation each, whose derivatives are difference
    quotients: only the size of an error is needed.
    """
    bits = numbers.bits
    with numbers.working(), flint.ctx.workprec(bits):
        names = dict(run_text(text, numbers.namespace()))  # those functions keep plain numbers
        names |= {name: _function(name) for name in {*FUNCTIONS.values(), "sqrt"} - {"abs"}}
        names |= {"abs": abs, "R": flint.arb, "PI": flint.arb.pi()}
        names["constant"] = lambda name: rounded(numbers.constant(name)).balls.item()
        names |= {name: _as_one(names[name], numbers)
                  for name in registered_names() if name in names}  # fmt: skip
        names["array"] = partial(from_balls, numbers)
        # only the function: the text before it was run on plain numbers
        function = run_text(text[text.rindex("def function(") :], names)["function"]

    def on_balls(*arguments: Array) -> Tracked | tuple[Tracked, ...]:
        with numbers.working(), flint.ctx.workprec(bits):
            return function(*(tracked(e).balls[()] for e in arguments))

    return on_balls


def _function(name: str) -> Function:
    """Return a function of generated text on balls."""

    def function(*arguments: Ball) -> Ball:
        first, *others = map(flint.arb, arguments)
        return getattr(flint.arb, name)(first, *others)  # atan2 is static in flint 0.8

    return function


def from_balls(numbers: Arithmetic, entries: list[Ball], *shape: int) -> Tracked:
    """Return balls, or whole numbers, as a `Tracked` array of that shape, row by row."""
    balls = np.empty(shape, dtype=object)
    balls[...] = np.array([flint.arb(e) for e in entries], dtype=object).reshape(shape)
    middles = np.array(plain(balls.flat, numbers.dtype), dtype=numbers.dtype)
    return Tracked(middles.reshape(shape), lambda: balls)


def _as_one(function: Function, numbers: Arithmetic) -> Function:
    """Return a function of numbers as one operation on balls."""
    nearby = numbers.eps**0.5

    def whole(*arguments: Ball) -> Ball | np.ndarray:
        flat = [flint.arb(e) for e in arguments]
        values = plain(flat, numbers.dtype)
        centre = np.array(function(*values), dtype=numbers.dtype)
        errors = abs(centre)
        for k, width in enumerate(plain([e.rad() for e in flat], numbers.dtype)):
            if width:
                moved = list(values)
                moved[k] = moved[k] + nearby
                change = np.array(function(*moved), dtype=numbers.dtype) - centre
                errors = errors + abs(change) / nearby * (width / numbers.eps)
        result = rounded(centre, errors).balls
        return result if centre.shape else result[()]

    return whole
