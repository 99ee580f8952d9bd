"""Deciding identities between analytic expressions by evaluation at random rational points.

An analytic function that vanishes at a random point of such generality vanishes identically; one
that does not vanish is practically always found.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable
from contextlib import suppress
from fractions import Fraction

import numpy as np

from .evaluation import evaluate, evaluate_at
from .lazy import sympy
from .types import Column, Exact, Expression, Letter, Number, Replacement, SymbolicMatrix


def _random_rational(generator: random.Random, small: bool) -> Exact:
    return sympy.Rational(generator.randrange(500, 1500), 20_000 if small else 1000)


def random_columns(
    lengths: dict[str, int], small: Iterable[str] = (), seed: int = 0
) -> dict[str, Column | Exact]:
    """Return random rational columns by name (`small`: inside every chart), with steps h and k."""
    generator, few = random.Random(f"discmech {seed}"), set(small)
    point = {
        name: sympy.Matrix(n, 1, [_random_rational(generator, name in few) for _ in range(n)])
        for name, n in lengths.items()
    }
    return {**point, "h": sympy.Rational(3, 5), "k": sympy.Rational(4, 7)}


def random_point(
    symbols: Iterable[Letter], small: Iterable[Letter] = (), seed: int = 0
) -> Replacement:
    """Return random rational values of symbols; symbols of `small` stay inside every chart."""
    generator, few = random.Random(f"discmech {seed}"), set(small)
    return {s: _random_rational(generator, s in few) for s in sorted(symbols, key=str)}


def is_zero(number: Expression) -> bool:
    """True if an exact number is zero: exactly if it is rational, otherwise by `vanishes`."""
    if number.is_Rational:
        return bool(number == 0)
    return vanishes(evaluate(number, 60), lambda: evaluate(number, 400))


def vanishes(short: Number, long: Callable[[], Number]) -> bool:
    """True if a number is zero that is `short` with 60 digits and `long()` with 400.

    The remainder of a zero is round-off, and shrinks by the added digits; any other number stays,
    however small its unit makes it.
    """
    return bool(short == 0) or bool(abs(long()) <= abs(short) * Fraction(1, 10**300))


def first_violation(
    entries: Iterable[Expression], small: Iterable[Letter] = (), points: int = 2
) -> Replacement | None:
    """Return a point where some expression is not zero, or None; `small` symbols stay small."""
    rest = [entry for entry in entries if entry != 0]
    symbols = set().union(*(e.free_symbols for e in rest)) if rest else set()
    for seed in range(points):
        point = random_point(symbols, small, seed)
        if not all(is_zero(entry.xreplace(point)) for entry in rest):
            return point
    return None


def vanishes_as(
    expression: Expression, h: Letter, order: int, small: Iterable[Letter] = (), points: int = 2
) -> bool:
    """True if an expression is O(h^order), from values at two steps and random other letters.

    From h = 10⁻⁴⁰ to a 10²⁰th of it a leading term c h^r falls by 10^{20r}, and the next ones do
    not show. There are digits beyond h^{order+1}; a smaller value is round-off of terms that
    cancel.
    """
    letters, few = sorted(expression.free_symbols - {h}, key=str), tuple(small)
    steps = [sympy.Rational(1, 10**k) for k in (40, 60)]
    for seed in range(points):
        point = random_point(letters, few, seed)
        near, nearer = (
            abs(evaluate_at([expression], {**point, h: step}, 60 * (order + 2))[0])
            for step in steps
        )
        least = Fraction(1, 10 ** (60 * (order + 1)))
        if not (nearer <= least or nearer <= near * Fraction(1, 10 ** (20 * order - 10))):
            return False
    return True


def shown(direction: SymbolicMatrix) -> str:
    """Return the text of a direction in three digits, for a message."""
    return ", ".join(f"{float(e):.3g}" for e in direction)


#: condition number below which a matrix is regular, for any round-off of double precision
CLEAR = 1e8


def _clearly_regular(matrix: SymbolicMatrix) -> bool:
    """Return True if double precision, which may overflow, tells that a matrix is regular."""
    with np.errstate(all="ignore"), suppress(OverflowError, np.linalg.LinAlgError):
        quick = np.array([float(e) for e in matrix]).reshape(matrix.shape)
        if not quick.size or not np.isfinite(quick).all():
            return False
        for axis in (1, 0):
            sizes = abs(quick).max(axis=axis, keepdims=True)
            if not np.isfinite(quick := quick / sizes).all():  # a row of zeros, or one too small
                return False
        return bool(np.linalg.cond(quick) < CLEAR)
    return False


def null_direction(matrix: SymbolicMatrix, tolerance: float = 1e-20) -> SymbolicMatrix | None:
    """Return a column that a matrix of numbers (of 30 digits) maps to zero, or None if it is
    regular.

    None also if an entry is not a finite real number: a root of a negative number at this point may
    be real at others. Rows and then columns are scaled first and pivots normalised on the way, so
    that masses of any size and in any unit count alike.
    """
    if not all(e.is_real and e.is_finite for e in matrix):
        return None
    if _clearly_regular(matrix):
        return None
    sizes = [max((abs(e) for e in matrix[i, :]), default=0) or 1 for i in range(matrix.rows)]
    scaled = sympy.Matrix(*matrix.shape, lambda i, j: matrix[i, j] / sizes[i])
    widths = [max((abs(e) for e in scaled[:, j]), default=0) or 1 for j in range(matrix.cols)]
    scaled = sympy.Matrix(*matrix.shape, lambda i, j: scaled[i, j] / widths[j])
    if scaled and np.linalg.cond(np.array(scaled.tolist(), dtype=float)) < CLEAR:
        return None
    reduced, pivots = scaled.rref(iszerofunc=lambda e: abs(e) <= tolerance, normalize_last=False)
    free = [j for j in range(matrix.cols) if j not in pivots]
    if not free:
        return None
    direction = sympy.zeros(matrix.cols, 1)
    direction[free[0]] = 1
    for i, j in enumerate(pivots):
        direction[j] = -reduced[i, free[0]] * widths[free[0]] / widths[j]
    return direction
