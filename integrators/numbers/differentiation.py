"""Derivatives of large sums, each term differentiated only by the letters it holds.

Sympy's `diff` asks every term of an expression about every letter: with the pair potentials of many
bodies that is nearly all of the time a derivation takes. The derivatives here are the same, sums
over terms in the same order.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .lazy import sympy


def jacobian(column: Any, letters: Sequence[Any]) -> Any:
    """∂(column)/∂(letters), a matrix with a row for each entry of the column."""
    wanted, known = frozenset(letters), dict[Any, Any]()
    rows = [_slopes(e, wanted, known) for e in column]
    return sympy.Matrix(
        len(rows), len(letters), [row.get(v, sympy.S.Zero) for row in rows for v in letters]
    )


def _slopes(e: Any, letters: frozenset[Any], known: dict[Any, dict[Any, Any]]) -> dict[Any, Any]:
    """{letter: derivative} for the letters that e holds."""
    if e in known:
        return known[e]
    if e.is_Symbol or e.is_Number:
        found = {e: e**0} if e in letters else {}
    elif e.is_Add:
        terms: dict[Any, list[Any]] = {}
        for term in e.args:
            for v, slope in _slopes(term, letters, known).items():
                terms.setdefault(v, []).append(slope)
        found = {v: e.func(*slopes) for v, slopes in terms.items()}
    elif e.is_Mul:
        terms = {}
        for i, factor in enumerate(e.args):
            for v, slope in _slopes(factor, letters, known).items():
                terms.setdefault(v, []).append(e.func(*e.args[:i], slope, *e.args[i + 1 :]))
        found = {v: slopes[0] if len(slopes) == 1 else _sum(slopes) for v, slopes in terms.items()}
    elif e.is_Pow and e.exp.is_Number:
        inner = _slopes(e.base, letters, known)
        outer = e.exp * e.base ** (e.exp - 1)
        found = {v: outer * slope for v, slope in inner.items()}
    else:  # functions know their own derivatives
        found = {v: e.diff(v) for v in e.free_symbols & letters}
    known[e] = {v: slope for v, slope in found.items() if slope != 0}
    return known[e]


def _sum(terms: list[Any]) -> Any:
    return sympy.Add(*terms)
