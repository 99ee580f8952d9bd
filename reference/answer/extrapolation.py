"""Gragg-Bulirsch-Stoer extrapolation on gmpy2 numbers: the second, independent method.

Gragg's explicit midpoint rule with n = 2, 4, 6, ... substeps has an error expansion in even powers
of the substep; Aitken-Neville extrapolation of k of them gives order 2k (Hairer, Norsett, Wanner,
Solving Ordinary Differential Equations I, II.9). The right-hand side is printed by another route
than the Taylor series: plain scalar code, evaluated point by point, nothing expanded.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

import gmpy2
import sympy

from ..equations import Equations, is_short, number_to_mpfr
from ..failures import ReferenceFailure
from ..progress import tell
from ..taylor import BITS, Sweep

Field = Callable[[list[Any], list[Any]], list[Any]]


def compile_field(equations: Equations) -> tuple[Field, tuple[sympy.Expr, ...]]:
    """Return rates(z, constants) as plain Python code, and the exact constants in it."""
    constants: dict[sympy.Expr, sympy.Symbol] = {}

    def held(expression: sympy.Expr) -> sympy.Expr:
        """Replace numbers other than short integers by named constants."""
        if is_short(expression):
            return expression
        if not expression.free_symbols:
            return constants.setdefault(expression, sympy.Symbol(f"c{len(constants)}"))
        if expression.is_Pow and not expression.exp.is_Integer and (2 * expression.exp).is_Integer:
            return sympy.Function("sqrt_")(held(expression.base)) ** (2 * expression.exp)
        if not expression.args:
            return expression
        return expression.func(*(held(argument) for argument in expression.args), evaluate=False)

    shared, rates = sympy.cse(equations.rates, symbols=sympy.numbered_symbols("s", real=True))
    before = [(symbol, held(value)) for symbol, value in (*equations.assignments, *shared)]
    results = [held(rate) for rate in rates]
    functions = [{"sqrt_": gmpy2.sqrt}, vars(gmpy2)]
    letters = [equations.states, tuple(constants.values())]
    field = sympy.lambdify(letters, results, functions, cse=lambda e: (before, e))
    return field, tuple(constants)


def extrapolate(
    equations: Equations, times: Sequence[Fraction], digits: int, max_steps: int = 100_000
) -> Sweep:
    """Return the solution at the given times, forward and backward from 0.

    The tolerance is 10^-digits per step. The arithmetic has nine more digits, and those lost by the
    alternating weights.
    """
    field, numbers = compile_field(equations)
    columns = max(6, round(0.36 * digits))
    weights = neville_weights(columns)
    working = digits + 9 + round(math.log10(sum(map(abs, weights[0]))))
    with gmpy2.context(gmpy2.get_context(), precision=math.ceil(working * BITS)):
        constants = [number_to_mpfr(value, working) for value in numbers]
        start = [number_to_mpfr(value, working) + gmpy2.mpfr(0) for value in equations.start]
        states, steps = {Fraction(0): start}, 0
        tolerance = gmpy2.mpfr(10) ** -digits
        for direction in (1, -1):
            state, now = start, gmpy2.mpfr(0)
            size = gmpy2.mpfr(1)
            for t in sorted((t for t in times if t * direction > 0), key=abs):
                goal = gmpy2.mpfr(gmpy2.mpq(t.numerator, t.denominator))
                while now != goal:
                    whole = size >= abs(goal - now)
                    step = goal - now if whole else direction * size
                    after, error = _basic_step(field, constants, state, step, columns, weights)
                    steps += 1
                    tell(f"{equations.name}: extrapolation", now, goal)
                    factor = gmpy2.mpfr("0.25")
                    if gmpy2.is_finite(error):  # the error is of order 2k - 1 in the step
                        ratio = tolerance / (error + tolerance * tolerance)
                        factor = ratio ** (gmpy2.mpfr(1) / (2 * columns - 1)) * gmpy2.mpfr("0.95")
                    best = abs(step) * min(max(factor, gmpy2.mpfr("0.05")), gmpy2.mpfr(3))
                    if error <= tolerance:
                        state, now = after, goal if whole else now + step
                    size = max(size, best) if now == goal else best
                    if steps > max_steps or not size > tolerance:
                        raise ReferenceFailure(
                            f"extrapolation of scene {equations.name} stops at t = "
                            f"{now:.6g}: the solution is singular there; "
                            "ask for an earlier time"
                        )
                states[t] = state
        return Sweep({t: states[t] for t in times}, steps, 2 * columns)


def neville_weights(columns: int) -> tuple[list[Fraction], list[Fraction]]:
    """Return the weights of T_kk and T_k,k-1 for the results of n = 2, 4, ..., 2k substeps (exact).

    w_j = prod_{i != j} n_j^2 / (n_j^2 - n_i^2): the polynomial through them, at substep 0.
    """

    def of(counts: range) -> list[Fraction]:
        weights = []
        for a in counts:
            weight = Fraction(1)
            for b in counts:
                if a != b:
                    weight *= Fraction(a * a, a * a - b * b)
            weights.append(weight)
        return weights

    full = range(2, 2 * columns + 1, 2)
    return of(full), [Fraction(0), *of(full[1:])]


def _basic_step(
    field: Field,
    constants: list[Any],
    state: list[Any],
    step: Any,
    columns: int,
    weights: tuple[list[Fraction], list[Fraction]],
) -> tuple[list[Any], Any]:
    """Return one step and the distance of its last two extrapolations, relative to the state."""
    ends = []
    slope = field(state, constants)
    for n in range(2, 2 * columns + 1, 2):
        part = step / n
        double = 2 * part
        before, here = state, [z + part * r for z, r in zip(state, slope, strict=True)]
        for _ in range(n - 1):
            rate = field(here, constants)
            before, here = here, [z + double * r for z, r in zip(before, rate, strict=True)]
        ends.append(here)
    best, second = (
        [
            gmpy2.fsum(
                end[i] * gmpy2.mpq(w.numerator, w.denominator)
                for end, w in zip(ends, row, strict=True)
            )
            for i in range(len(state))
        ]
        for row in weights
    )
    scale = max(max(map(abs, best)), max(map(abs, state)))
    error = max(abs(a - b) for a, b in zip(best, second, strict=True))
    if not all(map(gmpy2.is_finite, best)):  # a maximum may ignore nan
        return best, gmpy2.nan()
    return best, error / scale if scale else error
