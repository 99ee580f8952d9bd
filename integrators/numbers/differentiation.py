"""Derivatives of large sums, each term differentiated only by the letters in it.

Sympy's `diff` differentiates every term of an expression by every letter: with the pair potentials
of many bodies that is nearly all of the time of a derivation. The derivatives here equal sympy's,
with their terms in its order.
"""

from __future__ import annotations

from .lazy import sympy
from .types import Expression, Expressions, Letter, Letters, SymbolicMatrix

Slopes = dict[Letter, Expression]


def jacobian(column: Expressions, letters: Letters) -> SymbolicMatrix:
    """Return ∂(column)/∂(letters), a matrix with a row for each entry of the column."""
    rows = slopes(column, letters)
    entries = [row.get(v, sympy.S.Zero) for row in rows for v in letters]
    return sympy.Matrix(len(rows), len(letters), entries)


def slopes(column: Expressions, letters: Letters) -> list[Slopes]:
    """Return {letter: ∂e/∂letter} of each entry e of the column, for the letters in it."""
    wanted, known = frozenset(letters), dict[Expression, Slopes]()
    return [_slopes(e, wanted, known) for e in column]


def _slopes(e: Expression, letters: frozenset[Letter], known: dict[Expression, Slopes]) -> Slopes:
    """Return {letter: derivative} for the letters in e."""
    if e in known:
        return known[e]
    if e.is_Symbol or e.is_Number:
        result = {e: e**0} if e in letters else {}
    elif e.is_Add or e.is_Mul:
        terms: dict[Letter, list[Expression]] = {}
        for i, part in enumerate(e.args):
            for v, slope in _slopes(part, letters, known).items():
                whole = slope if e.is_Add else e.func(*e.args[:i], slope, *e.args[i + 1 :])
                terms.setdefault(v, []).append(whole)
        result = {v: sympy.Add(*parts) for v, parts in terms.items()}
    elif e.is_Pow and e.exp.is_Number:
        inner = _slopes(e.base, letters, known)
        outer = e.exp * e.base ** (e.exp - 1)
        result = {v: outer * slope for v, slope in inner.items()}
    else:  # functions know their own derivatives
        result = {v: e.diff(v) for v in e.free_symbols & letters}
    known[e] = {v: slope for v, slope in result.items() if slope != 0}
    return known[e]
