"""A start on its constraints, phi(x0) = 0 and A(x0) v0 - a(x0) = 0.

A start that misses them only by the rounding of its numbers to doubles is corrected by Newton's
method with the least change, first x0, then v0. A larger error is refused.
"""

from __future__ import annotations

from typing import Any

import mpmath
import sympy
from mpmath.libmp import to_rational

from ..failures import ReferenceFailure

DIGITS = 130  # digits of the arithmetic
MET = 100  # digits to which a start that is not corrected satisfies its constraints
CORRECTIONS = 60


def on_constraints(
    name: str,
    start: tuple[sympy.Expr, ...],
    phi: sympy.Matrix,
    off: sympy.Matrix,
    x: Any,
    v: Any,
) -> tuple[sympy.Expr, ...]:
    """Return (x0, v0) on phi = 0 and off = A v - a = 0, correcting at most round-off.

    An entry of x0 counts as known to 4 units of round-off of the largest entry, and so does v0.
    Raises `ReferenceFailure` for a start that is farther off, and names one that is not.
    """
    n, both = len(x), [*x, *v]
    state, said = start, ""
    still = not any(off.xreplace(dict.fromkeys(v, sympy.S.Zero)))
    with mpmath.workdps(DIGITS):
        for what, rows, own in (
            ("phi(x0)", phi, range(n)),
            ("A(x0) v0" if still else "A(x0) v0 - a(x0)", off, range(n, len(both))),
        ):
            gap, ratio, moved = _projected(rows, both, state, own, n)
            if ratio > 4 * mpmath.mpf(2) ** -53 and not said:
                said = f"{what} = 0 of scene {name} is off by {float(gap):.3g}"
            if moved is None:
                break
            state = moved
    if said:
        end = " that satisfies it"
        if moved is not None:
            x0, v0 = ([float(e) for e in part] for part in (state[:n], state[n:]))
            end += f", such as x0={x0}, v0={v0}"
        raise ReferenceFailure(f"the constraint {said}; give a start{end}")
    return state


def _projected(
    rows: sympy.Matrix, letters: list[Any], start: tuple[sympy.Expr, ...], own: range, n: int
) -> tuple[Any, Any, tuple[sympy.Expr, ...] | None]:
    """Return (the largest |row|, the largest in units of its size, a start where the rows are 0).

    Only the letters at ``own`` change; the start is None if Newton's method does not converge. A
    row's size is the sum of its terms and of its change by a relative change of 1 in each block's
    largest entry.
    """
    if not len(rows):
        return 0, 0, start
    terms = [sum((abs(e) for e in sympy.Add.make_args(row)), sympy.S.Zero) for row in rows]
    values = sympy.lambdify([letters], [rows, rows.jacobian(letters), terms], "mpmath")
    z = mpmath.matrix([mpmath.mpf(str(e.evalf(DIGITS))) for e in start])
    first = mpmath.nan, mpmath.inf
    for corrections in range(CORRECTIONS):
        try:
            off, slope, sizes = values(list(z))
            largest = [max(map(abs, part), default=0) for part in (z[:n], z[n:])]
            for i in range(len(rows)):
                sizes[i] += sum(abs(slope[i, j]) * largest[j >= n] for j in range(len(z)))
            ratio = max(abs(e) / s if e else 0 for e, s in zip(off, sizes, strict=True))
            first = first if corrections else (max(map(abs, off)), ratio)
            if ratio <= mpmath.mpf(10) ** -MET:
                break
            moving = slope[:, own.start : own.stop]
            step = moving.T * mpmath.lu_solve(moving * moving.T, off)
        except (ArithmeticError, TypeError, ValueError):  # singular, or no real number
            return *first, None
        for j, change in zip(own, step, strict=True):
            z[j] -= change
    else:
        return *first, None
    if first[1] <= mpmath.mpf(10) ** -MET:
        return *first, start
    return *first, tuple(
        sympy.Rational(*map(int, to_rational(z[j]._mpf_))) if j in own else start[j]
        for j in range(len(z))
    )
