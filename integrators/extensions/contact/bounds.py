"""Bounds of gaps over boxes and along paths: a gap that dips within a step is found, however thin.

Interval arithmetic in double precision, of many boxes at a time (Moore 1966). A path is a cubic
from x to y by its control points, whose hull the path never leaves; where the bound of a gap over
the hull is negative the path is halved. Over a part of length s the bound by the slope,
φ(middle) − s/2 max|φ′ẋ|, misses by s² only, so that a path which all but touches needs few parts.
Bounds are not rounded outwards: they are good to the round-off within which a gap is closed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from ...numbers import Matrix, Number, sympy
from ...numbers.types import Expression, Letter, SymbolicMatrix

#: least and largest value: floats, or arrays with an entry per box
Interval: TypeAlias = tuple[Number, Number]

COARSE = 5  # number of halvings for the path of a step that is checked together with many others
# number of halvings for the path of a single step: this finds a gap that closes for 1e-9 of a step
FINE = 30
MANY = 2**12  # largest number of parts of a path
HALF = np.array([[8, 0, 0, 0], [4, 4, 0, 0], [2, 4, 2, 0], [1, 3, 3, 1]]) / 8
HALVES = np.array([HALF, HALF[::-1, ::-1]])  # control points of both halves (de Casteljau)
EVERYTHING = -np.inf, np.inf


class GapBounds:
    """Bounds of K gaps φ(x), with slope φ′ (K×n), at given values of the parameters."""

    def __init__(
        self, position: list[Letter], phi: list[Expression], slope: SymbolicMatrix,
        known: dict[Letter, float],
    ) -> None:  # fmt: skip
        self.position, self.phi, self.slope = position, phi, slope.tolist()
        self.known = {symbol: (value, value) for symbol, value in known.items()}

    def lowest(
        self, points: np.ndarray, slack: Matrix | float = 0.0, gaps: Sequence[int] | None = None
    ) -> np.ndarray:
        """Return lower bounds of the gaps, (r, K), over the hulls of the points (r, 4, n).

        slack (r, n) widens each hull; gaps: the indices of the gaps, by default all.
        """
        of = self._hull(points, slack)
        lows = [enclosed(self.phi[i], of)[0] for i in
                (range(len(self.phi)) if gaps is None else gaps)]  # fmt: skip
        shape = len(points), len(lows)
        bounds = np.array([np.broadcast_to(low, shape[:1]) for low in lows]).T.reshape(shape)
        return np.where(np.isnan(bounds), -np.inf, bounds)

    def _hull(self, points: np.ndarray, slack: Matrix | float = 0.0) -> dict[Letter, Interval]:
        low, high = points.min(axis=1) - slack, points.max(axis=1) + slack
        box = {e: (low[:, k], high[:, k]) for k, e in enumerate(self.position)}
        return {**self.known, **box}

    def open(self, rows: np.ndarray) -> np.ndarray:
        """Return for each path between neighbouring rows of x (r, n), r ≥ 3, True if all gaps are
        certainly positive on it."""
        points, slack = paths_through(rows)
        with np.errstate(all="ignore"):
            left = np.flatnonzero((self.lowest(points, slack) <= 0).any(axis=1))
            answers = np.ones(len(points), dtype=bool)
            parts, owners = points[left], left
            for _ in range(COARSE):
                if not len(parts):
                    return answers
                parts = _halved(parts)
                owners = np.repeat(owners, 2)
                low = (self.lowest(parts, slack[owners]) <= 0).any(axis=1)
                parts, owners = parts[low], owners[low]
            answers[owners] = False
        return answers

    def dip(self, points: np.ndarray, i: int, below: float) -> float | None:
        """Return where gap i is less than `below` on the path (4, n), as a share of the path.

        The result is None if the gap certainly is not, or only on less than 2⁻³⁰ of the path.
        """
        with np.errstate(all="ignore"):
            return self._dip(points, i, below)

    def _dip(self, points: np.ndarray, i: int, below: float) -> float | None:
        parts, starts, size = points[None], np.zeros(1), 1.0
        for _ in range(FINE):
            halves = _halved(parts)
            middle = self._value(halves[::2, 3], i)
            under = np.flatnonzero(middle < below)
            if len(under):
                return float(starts[under[0]] + size / 2)
            rate = self._rate(parts, i)
            steep = np.maximum(abs(rate[0]), abs(rate[1]))  # 3 (p₁ − p₀), …: for the whole part
            surely = self.lowest(parts, gaps=[i])[:, 0] >= below
            surely |= middle - steep / 2 >= below
            one_way = (rate[0] >= 0) | (rate[1] <= 0)
            ends = np.minimum(self._value(parts[:, 0], i), self._value(parts[:, 3], i))
            surely |= one_way & (ends >= below)
            left = np.flatnonzero(~surely)[:MANY]
            if not len(left):
                return None
            size /= 2
            parts = halves.reshape(-1, 2, *points.shape)[left].reshape(-1, *points.shape)
            starts = (starts[left][:, None] + [0, size]).ravel()
        return None

    def _value(self, x: np.ndarray, i: int) -> np.ndarray:
        """Return φ_i at points (r, n), (r,)."""
        at = {**self.known, **{e: (x[:, k], x[:, k]) for k, e in enumerate(self.position)}}
        return np.broadcast_to(enclosed(self.phi[i], at)[0], len(x))

    def _rate(self, parts: np.ndarray, i: int) -> Interval:
        """Return bounds of the change of gap i along each part."""
        of, steps = self._hull(parts), 3 * np.diff(parts, axis=1)
        rate: Interval = (np.zeros(len(parts)), np.zeros(len(parts)))
        for k, slope in enumerate(self.slope[i]):
            if slope != 0:
                way = steps[:, :, k].min(axis=1), steps[:, :, k].max(axis=1)
                rate = _sum(rate, _product(enclosed(slope, of), way))
        return np.nan_to_num(rate[0], nan=-np.inf), np.nan_to_num(rate[1], nan=np.inf)


def _halved(parts: np.ndarray) -> np.ndarray:
    """Return both halves of each path, one after the other, (2 r, 4, n)."""
    halves: np.ndarray = np.einsum("hij,rjn->rhin", HALVES, parts)
    return halves.reshape(-1, *parts.shape[1:])


def cubic(x: np.ndarray, rate: np.ndarray, y: np.ndarray, ending: np.ndarray) -> np.ndarray:
    """Return the control points (…, 4, n) of the cubic from x to y with the given end rates."""
    return np.stack([x, x + rate / 3, y - ending / 3, y], axis=-2)


def paths_through(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (control points (r − 1, 4, n) of cubics between the rows of x (r, n), slack (r − 1,
    n)).

    The rates are those of the parabola through a row and its neighbours. The motion behind the rows
    may leave the cubic by about the third difference, which is the slack.
    """
    rates = np.gradient(rows, axis=0, edge_order=2)
    points = cubic(rows[:-1], rates[:-1], rows[1:], rates[1:])
    bent = abs(np.diff(rates, 2, axis=0))
    near = np.concatenate([bent[:1], bent, bent[-1:]])
    return points, np.maximum(near[:-1], near[1:])


def enclosed(expression: Expression, at: dict[Expression, Interval]) -> Interval:
    """Return bounds of an expression over boxes; `at` maps symbols to boxes and keeps results.

    A function without a rule is bounded by −∞ and ∞.
    """
    interval = at.get(expression)
    if interval is None:
        interval = at[expression] = _enclosed(expression, at)
    return interval


def _enclosed(e: Expression, at: dict[Expression, Interval]) -> Interval:
    if e.is_number:
        try:
            value = float(e)
        except (TypeError, OverflowError):
            return EVERYTHING
        return value, value
    if e.is_Add:
        interval = enclosed(e.args[0], at)
        for part in e.args[1:]:
            interval = _sum(interval, enclosed(part, at))
        return interval
    if e.is_Mul:
        interval = enclosed(e.args[0], at)
        for part in e.args[1:]:
            interval = _product(interval, enclosed(part, at))
        return interval
    if e.is_Pow:
        return _power(e, at)
    if isinstance(e, sympy.Piecewise):  # any branch may hold
        parts = [enclosed(value, at) for value, _ in e.args]
        lows, highs = zip(*parts, strict=True)
        return _of_all(np.minimum, lows), _of_all(np.maximum, highs)
    rule = RULES.get(e.func.__name__)
    return EVERYTHING if rule is None else rule(*(enclosed(part, at) for part in e.args))


def _sum(a: Interval, b: Interval) -> Interval:
    return a[0] + b[0], a[1] + b[1]


def _product(a: Interval, b: Interval) -> Interval:
    if isinstance(a[0], float) and a[0] == a[1] != 0:  # a number
        return (a[0] * b[0], a[0] * b[1]) if a[0] > 0 else (a[0] * b[1], a[0] * b[0])
    products = [np.multiply(p, q) for p in a for q in b]
    # 0 · ∞ is NaN, which fmin and fmax ignore
    return _of_all(np.fmin, products), _of_all(np.fmax, products)


def _of_all(pick: Callable[..., Number], values: Sequence[Number]) -> Number:
    extreme = values[0]
    for value in values[1:]:
        extreme = pick(extreme, value)
    return extreme


def _power(e: Expression, at: dict[Expression, Interval]) -> Interval:
    base, exponent = e.args
    low, high = enclosed(base, at)
    if exponent.is_integer and exponent.is_number:
        n = int(exponent)
        if n < 0:
            return _inverse(_whole_power((low, high), -n))
        return _whole_power((low, high), n)
    # a power with a fractional exponent is real only if its base is not negative
    low, high = np.maximum(low, 0.0), np.maximum(high, 0.0)
    if exponent.is_number:
        size = float(abs(exponent))
        powers = low**size, high**size
        return powers if exponent > 0 else _inverse(powers)
    logs = _product(enclosed(exponent, at), (np.log(low), np.log(high)))
    return np.exp(logs[0]), np.exp(logs[1])


def _whole_power(a: Interval, n: int) -> Interval:
    low, high = np.float64(a[0]) ** n if np.ndim(a[0]) == 0 else a[0] ** n, a[1] ** n
    if n % 2:
        return low, high
    through = (a[0] < 0) & (a[1] > 0) if np.ndim(a[0]) or np.ndim(a[1]) else a[0] < 0 < a[1]
    return np.where(through, 0.0, np.minimum(low, high)), np.maximum(low, high)


def _inverse(a: Interval) -> Interval:
    low, high = np.asarray(a[0], dtype=float), np.asarray(a[1], dtype=float)
    sure = (low > 0) | (high < 0)
    from_above = np.where(low == 0, np.inf, 1 / low)  # a base that begins at 0
    one_sided = sure | ((low == 0) & (high > 0))
    return (np.where(one_sided, 1 / high, -np.inf), np.where(one_sided, from_above, np.inf))


def _rising(f: Callable[..., Number], least: float = -np.inf) -> Callable[[Interval], Interval]:
    return lambda a: (f(np.maximum(a[0], least)), f(np.maximum(a[1], least)))


def _cosine(a: Interval) -> Interval:
    """Bound the cosine; extremes are ±1 if an even or odd multiple of π lies in the interval."""
    low, high = np.minimum(np.cos(a[0]), np.cos(a[1])), np.maximum(np.cos(a[0]), np.cos(a[1]))
    turn = 2 * np.pi
    top = np.floor(np.divide(a[1], turn)) >= np.ceil(np.divide(a[0], turn))
    bottom = np.floor((a[1] - np.pi) / turn) >= np.ceil((a[0] - np.pi) / turn)
    return np.where(bottom, -1.0, low), np.where(top, 1.0, high)


def _tangent(a: Interval) -> Interval:
    same = np.floor(np.divide(a[0], np.pi) + 0.5) == np.floor(np.divide(a[1], np.pi) + 0.5)
    return np.where(same, np.tan(a[0]), -np.inf), np.where(same, np.tan(a[1]), np.inf)


def _size(a: Interval) -> Interval:
    low = np.maximum(np.maximum(a[0], np.negative(a[1])), 0.0)
    return low, np.maximum(np.abs(a[0]), np.abs(a[1]))


def _hyperbolic_cosine(a: Interval) -> Interval:
    low, high = _size(a)
    return np.cosh(low), np.cosh(high)


def _angle(y: Interval, x: Interval) -> Interval:
    """Bound atan2: by the corners if the box is right of the origin, else by ±π."""
    corners = [np.arctan2(p, q) for p in y for q in x]
    right = np.asarray(x[0]) > 0
    return (np.where(right, _of_all(np.minimum, corners), -np.pi),
            np.where(right, _of_all(np.maximum, corners), np.pi))  # fmt: skip


RULES: dict[str, Callable[..., Interval]] = {
    "exp": _rising(np.exp), "log": _rising(np.log, 0.0), "atan": _rising(np.arctan),
    "asin": _rising(np.arcsin), "sinh": _rising(np.sinh), "tanh": _rising(np.tanh),
    "asinh": _rising(np.arcsinh), "acosh": _rising(np.arccosh, 1.0), "sign": _rising(np.sign),
    "acos": lambda a: (np.arccos(a[1]), np.arccos(a[0])), "cosh": _hyperbolic_cosine,
    "sin": lambda a: _cosine((a[0] - np.pi / 2, a[1] - np.pi / 2)),
    "cos": _cosine, "tan": _tangent, "Abs": _size, "atan2": _angle,
    "Heaviside": _rising(lambda v: np.heaviside(v, 0.5)),
    "Max": lambda *a: tuple(_of_all(np.maximum, ends) for ends in zip(*a, strict=True)),
    "Min": lambda *a: tuple(_of_all(np.minimum, ends) for ends in zip(*a, strict=True)),
}  # fmt: skip
