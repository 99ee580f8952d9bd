"""Jacobians over boxes: ball arithmetic on arrays of doubles, differentiated forward on the tape.

A ball is a centre c and a radius r >= |true - c|, elementwise. Roundings of c are added to r; the
machine's elementary functions are taken to be right to four units in the last place. A ball that
proves nothing has r = inf or nan.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from .tape import INTEGRALS, Linear

if TYPE_CHECKING:
    from .series import SeriesProgram

ULPS = 2.0**-50
UP = 1 + 2.0**-48
TINY = 2.0**-1000


@dataclass(frozen=True)
class Ball:
    """Centre and radius, arrays of one shape."""

    c: Any
    r: Any

    def __add__(self, other: Ball) -> Ball:
        return ball(self.c + other.c, self.r + other.r)

    def __mul__(self, other: Ball) -> Ball:
        spread = abs(self.c) * other.r + self.r * (abs(other.c) + other.r)
        return ball(self.c * other.c, spread)

    def scaled(self, factor: Ball) -> Ball:
        """Each row (last axis) times its own factor."""
        return self * Ball(factor.c[..., None], factor.r[..., None])

    def low(self) -> Any:
        """A lower bound of |true|: nan if zero is not excluded."""
        import numpy as np

        least = (abs(self.c) - self.r) / UP
        return np.where(least > 0, least, np.nan)


def ball(c: Any, r: Any) -> Ball:
    """With room for the rounding of c and of r."""
    return Ball(c, r * UP + abs(c) * ULPS + TINY)


def constant(value: Any) -> Ball:
    """An exact number."""
    import numpy as np
    import sympy

    c = np.float64(float(sympy.sympify(value).evalf(30)))
    return ball(c, abs(c) * ULPS)


def jacobian(program: SeriesProgram, centre: Any, radius: Any) -> tuple[Any, Any]:
    """The partial derivatives of the rates over boxes: centres and radii, (lanes, rates, n).

    ``centre`` and ``radius`` are (lanes, n): row k is the box |z - centre| <= radius.
    """
    import numpy as np

    lanes, n = centre.shape
    values: list[Ball] = []
    slopes: list[Ball] = []

    def combined(form: Linear) -> tuple[Ball, Ball]:
        value = Ball(np.zeros(lanes), np.zeros(lanes))
        slope = Ball(np.zeros((lanes, n)), np.zeros((lanes, n)))
        for node, factor in form.items():
            by = constant(factor)
            value = value + (by if node is None else values[node] * by)
            if node is not None:
                slope = slope + slopes[node] * by
        return value, slope

    with np.errstate(all="ignore"):
        for place, operation in enumerate(program.operations):
            kind = operation[0]
            if kind == "state":
                unit = np.zeros((lanes, n))
                unit[:, place] = 1.0
                value, slope = Ball(centre[:, place], radius[:, place]), Ball(unit, 0 * unit)
            elif kind == "linear":
                value, slope = combined(dict(operation[1]))
            elif kind in ("times", "over"):
                a, b = operation[1:]
                other, change = values[b], slopes[b]
                if kind == "over":
                    other, rate = _inverse(values[b])
                    change = slopes[b].scaled(rate)
                value = values[a] * other
                slope = slopes[a].scaled(other) + change.scaled(values[a])
            else:
                a = operation[2] if kind == "integral" else operation[1]
                value, rate = _function(operation, values)
                slope = slopes[a].scaled(rate)
            values.append(value)
            slopes.append(slope)
        rows = [combined(form)[1] for form in program.rates]
        return np.stack([row.c for row in rows], 1), np.stack([row.r for row in rows], 1)


def _inverse(a: Ball) -> tuple[Ball, Ball]:
    value = ball(1 / a.c, a.r / (abs(a.c) * a.low()))
    square = value * value
    return value, Ball(-square.c, square.r)


def _function(operation: tuple[Any, ...], values: list[Ball]) -> tuple[Ball, Ball]:
    """Value and derivative of a function of one node."""
    import numpy as np

    kind = operation[0]
    if kind == "integral":
        name, place, slope = operation[1:]
        assert name in INTEGRALS
        a, rate = values[place], values[slope]
        arc = {"atan": "arctan", "asin": "arcsin", "acos": "arccos", "asinh": "arcsinh",
               "acosh": "arccosh", "atanh": "arctanh"}  # fmt: skip
        return ball(getattr(np, arc.get(name, name))(a.c), (abs(rate.c) + rate.r) * a.r), rate
    a = values[operation[1]]
    if kind == "square":
        return a * a, a * constant(2)
    if kind == "inverse":
        return _inverse(a)
    if kind == "sqrt":
        low = np.where(a.c > 0, a.low(), np.nan)
        root = ball(np.sqrt(a.c), a.r / (np.sqrt(a.c) + np.sqrt(low)))
        return root, _inverse(root)[0] * constant("1/2")
    if kind == "power":
        r = constant(operation[2])
        low = np.where(a.c > 0, a.low(), np.nan)
        top = (abs(a.c) + a.r) * UP
        power = abs(r.c) + r.r
        rate = _monotone(lambda z: r.c * z ** (r.c - 1), a, low, top)
        value = ball(a.c**r.c, (abs(rate.c) + rate.r) * a.r + abs(a.c**r.c) * power * ULPS * 1e3)
        return value, rate
    if kind == "exp":
        value = ball(np.exp(a.c), np.exp(a.c) * np.expm1(a.r))
        return value, value
    if kind in ("sin", "cos"):
        sin, cos = (ball(f(a.c), np.minimum(a.r, 2.0)) for f in (np.sin, np.cos))
        return (sin, cos) if kind == "sin" else (cos, Ball(-sin.c, sin.r))
    if kind in ("sinh", "cosh"):
        spread = a.r * np.cosh(abs(a.c) + a.r)
        sinh, cosh = (ball(f(a.c), spread) for f in (np.sinh, np.cosh))
        return (sinh, cosh) if kind == "sinh" else (cosh, sinh)
    sign = Ball(np.sign(a.c) + 0 * a.low(), np.zeros_like(a.r))
    return (sign, Ball(0 * a.c, 0 * a.r)) if kind == "sign" else (ball(abs(a.c), a.r), sign)


def _monotone(function: Any, a: Ball, low: Any, top: Any) -> Ball:
    """A ball around the values of a monotone function between low and top."""
    import numpy as np

    here, ends = function(a.c), (function(low), function(top))
    spread = np.maximum(abs(ends[0] - here), abs(ends[1] - here))
    return ball(here, spread + abs(here) * ULPS * 1e3)
