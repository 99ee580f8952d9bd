"""Balls, with centre and radius, computed by arb, which rounds all results outwards.

A proven bound relies on nothing else. Input enters exactly (mpfr numbers, doubles, fractions) or is
enclosed (other constants); output is a ball's end.
"""

from __future__ import annotations

from functools import lru_cache, reduce
from typing import Any

import flint
import gmpy2
import mpmath
import sympy
from flint import arb, arb_mat, fmpq
from mpmath.libmp import from_man_exp

from ..failures import Unproven
from .series import SeriesProgram
from .tape import Linear

BITS = 64  # bits of the arithmetic of bounds
NAMED = {"exp", "log", "sin", "cos", "tan", "cot", "sec", "csc", "sinh", "cosh", "tanh", "coth",
         "sech", "csch", "asin", "acos", "atan", "asinh", "acosh", "atanh", "gamma"}  # fmt: skip


def working(bits: int = BITS) -> Any:
    """Return a context in which centres have so many bits."""
    return flint.ctx.workprec(bits)


def exact(value: Any) -> Any:
    """Return an int, mpf or mpfr exactly; a non-finite one becomes nan, which bounds nothing."""
    if isinstance(value, int):
        return arb(value)
    if value - value != 0:  # nan differs from everything
        return arb.nan()
    sign, mantissa, exponent, _ = value._mpf_  # gmpy2 numbers have `_mpf_` too
    return arb((int(-mantissa if sign else mantissa), int(exponent)))


def rounded(number: Any) -> Any:
    """Return the end of a ball as an mpfr number, rounded by the current context."""
    if not number.is_finite():
        return gmpy2.mpfr("nan")
    mantissa, exponent = map(int, number.man_exp())
    return gmpy2.mpfr(gmpy2.mpq(mantissa) * gmpy2.mpq(2) ** exponent)


def enclosed(number: sympy.Expr) -> Any:
    """Return a ball around an exact sympy number; raises `Unproven` for functions arb lacks."""
    return _enclosed(number, flint.ctx.prec)


@lru_cache(maxsize=4096)
def _enclosed(number: Any, bits: int) -> Any:
    number = sympy.sympify(number)
    if number.is_Rational:
        return arb(fmpq(int(number.p), int(number.q)))
    named = {sympy.pi: arb.pi, sympy.E: arb.const_e, sympy.EulerGamma: arb.const_euler}
    if number in named:
        return named[number]()
    parts = [_enclosed(part, bits) for part in number.args]
    if number.is_Add:
        return sum(parts, arb(0))
    if number.is_Mul:
        return reduce(arb.__mul__, parts)
    if number.is_Pow:
        return parts[0].sqrt() if number.exp == sympy.Rational(1, 2) else parts[0] ** parts[1]
    name = type(number).__name__.lower()
    if len(parts) != 1 or name not in NAMED:
        raise Unproven(f"the constant {number} cannot be enclosed")
    return getattr(arb, name)(parts[0])


def around_zero(size: Any) -> Any:
    """Return the ball of all numbers whose size is at most that of a number in the given ball."""
    return arb(0, 1) * size


def largest(balls: Any) -> Any:
    """Return the largest |number| in some balls, exactly; nan if any of them is nan."""
    return reduce(arb.max, (ball.abs_upper() for ball in balls), arb(0))


def upper(ball: Any) -> Any:
    """Return an upper bound of the sizes of the ball's numbers: an mpf, perhaps infinite."""
    end = ball.abs_upper()
    if not end.is_finite():
        return mpmath.inf
    return mpmath.mp.make_mpf(from_man_exp(*map(int, end.man_exp())))


# Value and derivative of each function of one node; a sign that is not certain has no derivative.
FUNCTIONS: dict[str, Any] = {
    "square": lambda a: (a * a, 2 * a),
    "inverse": lambda a: (1 / a, -(1 / a) * (1 / a)),
    "sqrt": lambda a: (a.sqrt(), 1 / (2 * a.sqrt())),
    "exp": lambda a: (a.exp(), a.exp()),
    "sin": lambda a: (a.sin(), a.cos()),
    "cos": lambda a: (a.cos(), -a.sin()),
    "sinh": lambda a: (a.sinh(), a.cosh()),
    "cosh": lambda a: (a.cosh(), a.sinh()),
    "Abs": lambda a: (abs(a), a.sgn()),
    "sign": lambda a: (a.sgn(), 0 / a),
}


class BallRates:
    """The rates of a tape over boxes of states, differentiated forward.

    The derivatives are S^-1 (d rates / d states) S for S = diag(scale), exact numbers or 1.
    """

    def __init__(self, program: SeriesProgram, scale: list[Any] | None = None) -> None:
        n = program.size
        self.scale = scale or [arb(1)] * n
        self.units = [
            arb_mat(1, n, [size if i == j else 0 for j in range(n)])
            for i, size in enumerate(self.scale)
        ]
        self.operations = [
            ("linear", self._prepared(dict(operation[1])))
            if operation[0] == "linear"
            else (*operation[:2], enclosed(operation[2]))
            if operation[0] == "power"
            else operation
            for operation in program.operations[n:]
        ]
        self.rates = [self._prepared(form) for form in program.rates]

    def _prepared(self, form: Linear) -> list[tuple[int | None, Any]]:
        """Return enclosed factors, None for 1."""
        return [(n, None if c == 1 and n is not None else enclosed(c)) for n, c in form.items()]

    def __call__(self, box: list[Any]) -> tuple[list[Any], Any]:
        """Return rates and derivatives, rates x states: balls around all values in the box."""
        values, slopes = list(box), list(self.units)
        nothing = 0 * self.units[0]

        def of_form(form: list[tuple[int | None, Any]]) -> tuple[Any, Any]:
            value, slope = arb(0), nothing
            for node, factor in form:
                if node is None:
                    value = value + factor
                elif factor is None:
                    value, slope = value + values[node], slope + slopes[node]
                else:
                    value, slope = value + values[node] * factor, slope + slopes[node] * factor
            return value, slope

        for kind, *places in self.operations:
            if kind == "linear":
                value, slope = of_form(places[0])
            elif kind == "times":
                a, b = places
                value = values[a] * values[b]
                slope = slopes[a] * values[b] + slopes[b] * values[a]
            elif kind == "over":
                a, b = places
                value = values[a] / values[b]
                slope = (slopes[a] - slopes[b] * value) * (1 / values[b])
            elif kind == "integral":
                name, a, rate = places
                value, slope = getattr(arb, name)(values[a]), slopes[a] * values[rate]
            elif kind == "power":
                a, exponent = places
                value = values[a] ** exponent
                slope = slopes[a] * (exponent * value / values[a])
            else:
                value, rate = FUNCTIONS[kind](values[places[0]])
                slope = slopes[places[0]] * rate
            values.append(value)
            slopes.append(slope)
        pairs = [of_form(form) for form in self.rates]
        rows = [slope * (1 / size) for (_, slope), size in zip(pairs, self.scale, strict=False)]
        entries = [entry for row in rows for entry in row.entries()]
        return [value for value, _ in pairs], arb_mat(len(rows), len(box), entries)
