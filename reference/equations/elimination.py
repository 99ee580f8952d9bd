"""Accelerations from a mass matrix: mass(x, xi) * rate = force, solved once, symbolically."""

from __future__ import annotations

from typing import Any

import sympy

from ..failures import ReferenceFailure

ROUND_OFF = sympy.Float("1e-30")  # round-off of numbers with 40 digits


def explicit_rates(
    name: str, mass: sympy.Matrix, force: sympy.Matrix, start: dict[Any, Any], velocities: int
) -> tuple[list[tuple[Any, Any]], list[sympy.Expr]]:
    """Solve mass * rate = force; a variable mass matrix gives a list of assignments.

    Gaussian elimination; each pivot is the largest of its column at the start, and counts as zero
    if it is round-off of the terms that were summed: a fixed threshold would depend on units. The
    rows of the ``velocities`` come first, since their mass matrix is regular: a constraint's row as
    a pivot may pass through zero later.
    """
    m = mass.rows
    singular = ReferenceFailure(
        f"the mass matrix d2l/dxi2 of scene {name} is singular at the start; "
        "give every velocity a kinetic term"
    )
    dependent = ReferenceFailure(
        f"the constraints of scene {name} are dependent at the start: one vanishes there or "
        "follows from the others; start elsewhere, or leave it out"
    )
    if not mass.free_symbols:
        if mass.rank() < m:
            raise singular if mass[:velocities, :velocities].rank() < velocities else dependent
        return [], list(mass.LUsolve(force))
    work = mass.row_join(force)
    assignments: list[tuple[Any, Any]] = []
    values = {symbol: value.evalf(40) for symbol, value in start.items()}

    def value(expression: sympy.Expr) -> sympy.Expr:
        known = {e: values[e] for e in expression.free_symbols if e in values}
        return expression.xreplace(known).evalf(40)

    def hold(expression: sympy.Expr) -> sympy.Expr:
        if expression.is_Atom:
            return expression
        symbol = sympy.Symbol(f"w{len(assignments)}", real=True)
        assignments.append((symbol, expression))
        values[symbol] = value(expression)
        return symbol

    terms = [[sum(abs(value(t)) for t in sympy.Add.make_args(work[r, j])) for j in range(m)]
             for r in range(m)]  # fmt: skip
    for i in range(m):
        for j in range(m + 1):
            work[i, j] = hold(work[i, j])
    for c in range(m):
        sizes = [abs(value(work[r, c])) for r in range(c, velocities if c < velocities else m)]
        best = max(range(len(sizes)), key=lambda r: sizes[r])
        if not sizes[best] > ROUND_OFF * terms[c + best][c]:
            raise singular if c < velocities else dependent
        work.row_swap(c, c + best)
        terms[c], terms[c + best] = terms[c + best], terms[c]
        for r in range(c + 1, m):
            factor = hold(work[r, c] / work[c, c])
            for j in range(c + 1, m + 1):
                if j < m:
                    terms[r][j] += abs(value(factor)) * terms[c][j]
                work[r, j] = hold(work[r, j] - factor * work[c, j])
    rates: list[sympy.Expr] = [sympy.S.Zero] * m
    for r in reversed(range(m)):
        known = sum((work[r, j] * rates[j] for j in range(r + 1, m)), sympy.S.Zero)
        rates[r] = hold((work[r, m] - known) / work[r, r])
    return assignments, rates
