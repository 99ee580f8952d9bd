"""Running error analysis: numbers that carry a bound of their round-off.

Each operation adds one rounding of its result to the errors of its operands (Higham, Accuracy and
Stability of Numerical Algorithms, 3.3). So an evaluation in another precision ε is off by at most
`error`·ε, to first order, for any cancellation: sums of absolute terms, operations and the
conditioning of every function are included, and units of length, time and mass with them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cache, cached_property, partial
from typing import Any

import numpy as np

from .arithmetic import Arithmetic
from .types import Number, Vector

SAFE = (1e-75, 1e75)
CERTAIN = 2.0**30  # largest condition of a matrix that is inverted in doubles for a bound


class RunningError:
    """A number and a bound of its error in units of round-off: value ± error·ε."""

    __slots__ = ("error", "value")

    def __init__(self, value: Number, error: Number = 0) -> None:
        self.value, self.error = value, error

    def __add__(self, other: Any) -> RunningError:
        if type(other) is not RunningError:  # a number without an error
            total = self.value + other
            return RunningError(total, self.error + abs(total))
        total = self.value + other.value
        return RunningError(total, self.error + other.error + abs(total))

    def __mul__(self, other: Any) -> RunningError:
        if type(other) is not RunningError:
            product = self.value * other
            return RunningError(product, abs(other) * self.error + abs(product))
        product = self.value * other.value
        error = abs(self.value) * other.error + abs(other.value) * self.error
        return RunningError(product, error + abs(product))

    def __truediv__(self, other: Any) -> RunningError:
        other = running(other)
        ratio = self.value / other.value
        error = (self.error + abs(ratio) * other.error) / abs(other.value)
        return RunningError(ratio, error + abs(ratio))

    def __pow__(self, power: Any) -> RunningError:
        power = running(power)
        value = self.value**power.value
        slope = power.value * self.value ** (power.value - 1) if power.value else 0
        error = abs(slope) * self.error if self.error else 0
        if power.error:
            error += abs(value) * power.error * abs(np.log(float(abs(self.value))))
        return RunningError(value, error + abs(value))

    __radd__, __rmul__ = __add__, __mul__

    def __sub__(self, other: Any) -> RunningError:
        if type(other) is not RunningError:
            return self + -other
        total = self.value - other.value
        return RunningError(total, self.error + other.error + abs(total))

    def __rsub__(self, other: Any) -> RunningError:
        return -self + other

    def __rtruediv__(self, other: Any) -> RunningError:
        return running(other) / self

    def __rpow__(self, other: Any) -> RunningError:
        return running(other) ** self

    def __neg__(self) -> RunningError:
        return RunningError(-self.value, self.error)

    def __pos__(self) -> RunningError:
        return self

    def __abs__(self) -> RunningError:
        return RunningError(abs(self.value), self.error)


def running(value: Any) -> RunningError:
    """Return the value itself, or the value with no error so far."""
    return value if isinstance(value, RunningError) else RunningError(value)


class Tracked:
    """An array of numbers with a bound of each one's error: the same by whole matrices.

    It goes through numpy's functions that only move entries (stack, block, transpose) and through
    @, +, − and `solve`. Bounds are `sizes`: a bound needs few digits. They cost more than the
    values and are computed when they are first used, by `bound()`; without a `bound` they are 0.
    """

    __array_ufunc__ = None  # a plain array leaves its operators to this class

    def __init__(self, value: np.ndarray, bound: Callable[[], np.ndarray] | None = None) -> None:
        self.value, self._bound = value, bound

    @cached_property
    def error(self) -> np.ndarray:
        """The bounds, of the value's shape, in units of round-off."""
        return np.zeros(np.shape(self.value)) if self._bound is None else sizes(self._bound())

    def __array_function__(self, function: Any, types: Any, arguments: Any, more: Any) -> Tracked:
        values = _each(arguments, lambda e: tracked(e).value)

        def bound() -> np.ndarray:
            return np.asarray(function(*_each(arguments, lambda e: tracked(e).error), **more))

        return Tracked(function(*values, **more), bound)

    def __matmul__(self, other: Any) -> Tracked:
        other = tracked(other)

        def bound() -> np.ndarray:
            a, b = sizes(abs(self.value)), sizes(abs(other.value))
            return np.asarray(self.error @ b + a @ (other.error + len(b) * b))

        return Tracked(product(self.value, other.value), bound)

    def __rmatmul__(self, other: Any) -> Tracked:
        return tracked(other) @ self

    def __add__(self, other: Any) -> Tracked:
        other = tracked(other)
        total = self.value + other.value
        return Tracked(total, lambda: self.error + other.error + sizes(abs(total)))

    def __neg__(self) -> Tracked:
        return Tracked(-self.value, lambda: self.error)

    def __sub__(self, other: Any) -> Tracked:
        return self + -tracked(other)

    def __rsub__(self, other: Any) -> Tracked:
        return -self + other

    def __truediv__(self, number: Number) -> Tracked:
        value = self.value / number
        return Tracked(value, lambda: self.error / abs(number) + 2 * abs(value))

    def __getitem__(self, place: Any) -> Tracked:
        return Tracked(self.value[place], lambda: self.error[place])

    @property
    def T(self) -> Tracked:
        """The transpose."""
        return Tracked(self.value.T, lambda: self.error.T)

    @property
    def shape(self) -> tuple[int, ...]:
        """The array's shape."""
        return self.value.shape

    def __mul__(self, number: Number) -> Tracked:
        value = self.value * number
        return Tracked(value, lambda: self.error * abs(number) + 2 * abs(value))

    __radd__, __rmul__ = __add__, __mul__


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a @ b; with many digits products with 0 cost as much, so zeros of b are left out."""
    if a.dtype != object or b.ndim < 2 or b.all():
        return np.asarray(a @ b)
    found = np.empty((*a.shape[:-1], b.shape[1]), dtype=object)
    for column, used in enumerate((b != 0).T):
        found[..., column] = a[..., used] @ b[used, column]
    return found


def sizes(found: Vector) -> Vector:
    """Return numbers ≥ 0 as doubles, unless a product of four may leave the doubles' range."""
    if found.dtype != object:
        return found
    doubles = found.astype(float)
    least, most = SAFE
    return doubles if (((least < doubles) & (doubles < most)) | (found == 0)).all() else found


def _each(nested: Any, change: Callable[[Any], Any]) -> Any:
    if isinstance(nested, list | tuple):
        return [_each(e, change) for e in nested]
    return change(nested) if isinstance(nested, np.ndarray | Tracked) else nested


def tracked(array: Any) -> Tracked:
    """Return an array as `Tracked`: `RunningError`s with their errors, plain numbers without."""
    if isinstance(array, Tracked):
        return array
    array = np.asarray(array)
    if array.dtype == object:
        return Tracked(values_of(array), lambda: errors_of(array))
    return Tracked(array)


def tracked_later(values: Iterable[Any], again: Callable[[], Iterable[Any]]) -> list[Tracked]:
    """Return arrays as `Tracked`, with the errors of `again()`: the same ones, `tracked`."""
    once = cache(lambda: [tracked(e) for e in again()])
    return [Tracked(e, partial(lambda k: once()[k].error, k)) for k, e in enumerate(values)]


def solve(numbers: Arithmetic, a: Any, b: Any) -> Any:
    """Return a⁻¹ b of plain or tracked arrays (`Arithmetic.solve`); a is k×k, b has k rows."""
    if not isinstance(a, Tracked) and not isinstance(b, Tracked):
        return numbers.solve(a, b)
    a, b = tracked(a), tracked(b)
    x = numbers.solve(a.value, b.value)

    def bound() -> np.ndarray:
        solved = a.error + 3 * len(a.value) * sizes(elimination_sizes(a.value))
        return np.asarray(inverse_sizes(numbers, a.value) @ (solved @ sizes(abs(x)) + b.error))

    return Tracked(x, bound)


def elimination_sizes(a: np.ndarray) -> np.ndarray:
    """Return |L||U| of elimination with row exchanges, k×k, its rows in the order of a's.

    The computed x solves (a + Δ) x = b with |Δ| ≤ 3kε|L||U| (Higham, Accuracy and Stability of
    Numerical Algorithms, 9.4). |a| in its place is too small where a has a zero that elimination
    fills and empties again: the remainder there is round-off of the fill.
    """
    k = len(a)
    rows, order, total = [list(row) for row in a], list(range(k)), np.zeros_like(abs(a))
    for p in range(k):
        best = max(range(p, k), key=lambda row: abs(rows[row][p]))
        rows[p], rows[best] = rows[best], rows[p]
        order[p], order[best] = order[best], order[p]
        lead = rows[p]
        total[order[p], p:] += [abs(e) for e in lead[p:]]
        for row, own in zip(rows[p + 1 :], order[p + 1 :], strict=True):
            if row[p] and lead[p]:
                factor = row[p] / lead[p]
                for i in range(p, k):
                    total[own, i] += abs(factor * lead[i])
                    row[i] = row[i] - factor * lead[i]
                row[p] = 0
    return total


def inverse_sizes(numbers: Arithmetic, a: np.ndarray) -> np.ndarray:
    """Return |a⁻¹| of a k×k matrix, for bounds: like `sizes` with no more digits than a double.

    It is inverted in doubles with rows and columns of size 1, in any units, and is off by k·ε·cond,
    k·2.4e-7 of a bound where cond is at most `CERTAIN`. For a larger cond, or numbers beyond the
    doubles' range, all digits are used.
    """
    small = sizes(abs(a))
    if small.size and a.dtype == object and small.dtype != object and small.any(axis=0).all():
        columns = 1 / small.max(axis=0)
        rows = 1 / (small * columns).max(axis=1, initial=1e-300)
        scaled = a.astype(float) * columns * rows[:, None]
        with suppress(np.linalg.LinAlgError):
            inverse = abs(np.linalg.inv(scaled))
            if inverse.sum(axis=1).max(initial=0) * len(a) < CERTAIN:
                return np.asarray(columns[:, None] * inverse * rows)
    return sizes(abs(numbers.solve(a, numbers.identity(len(a)))))


def rounded(values: Vector, errors: Any = None) -> Vector:
    """Return numbers with errors (by default one rounding each) as `RunningError`, same shape."""
    values = np.asarray(values)
    errors = abs(values) if errors is None else np.broadcast_to(errors, values.shape)
    pairs = zip(values.ravel(), errors.ravel(), strict=True)
    found = np.empty(values.size, dtype=object)
    found[:] = [RunningError(value, error) for value, error in pairs]
    return found.reshape(values.shape)


def errors_of(found: Vector) -> Vector:
    """Return the errors of an array of `RunningError`s or plain numbers, which have none."""
    errors = [e.error if type(e) is RunningError else 0 for e in found.ravel()]
    return np.array(errors).reshape(found.shape)


def values_of(found: Vector) -> Vector:
    """Return the values of an array of `RunningError`s or plain numbers."""
    values = [e.value if type(e) is RunningError else e for e in found.ravel()]
    return np.array(values).reshape(found.shape)
