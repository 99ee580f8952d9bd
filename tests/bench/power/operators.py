"""Mutation operators: small slips of the pen in a symbolic expression, at a seeded place.

An operator takes a sympy matrix (or a scalar) and a random generator, and returns a changed copy,
or None where it finds no place. A place is an entry and, in it, a term of one of its sums.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from typing import Any

from discmech.integrators.numbers import sympy

Operator = Callable[[Any, random.Random, Any], Any]
Path = tuple[int, ...]


def _terms(e: Any, path: Path = ()) -> Iterator[Path]:
    """Every term of every sum inside an expression, by the arguments that lead there."""
    if e.is_Add:
        yield from ((*path, i) for i in range(len(e.args)))
    for i, part in enumerate(e.args):
        yield from _terms(part, (*path, i))


def _replaced(e: Any, path: Path, change: Callable[[Any], Any]) -> Any:
    if not path:
        return change(e)
    parts = list(e.args)
    parts[path[0]] = _replaced(parts[path[0]], path[1:], change)
    return e.func(*parts)


def _term(change: Callable[[Any, Any], Any]) -> Operator:
    """An operator that changes one term of one sum; of an entry without sums, the entry."""

    def operator(matrix: Any, generator: random.Random, h: Any) -> Any:
        entries = [k for k, e in enumerate(matrix) if e != 0]
        if not entries:
            return None
        k = generator.choice(entries)
        place = generator.choice([*_terms(matrix[k])] or [()])
        return _with_entry(matrix, k, _replaced(matrix[k], place, lambda e: change(e, h)))

    return operator


def _with_entry(matrix: Any, k: int, value: Any) -> Any:
    changed = matrix.copy()
    changed[k] = value
    return changed


def _scaled(factor: str) -> Callable[[Any, Any], Any]:
    return lambda term, h: term * sympy.Rational(factor)


def _exchange(places: Callable[[Any, Any], list[tuple[int, Any, Any]]]) -> Operator:
    """An operator that puts something else in the place of a part of one entry.

    places: (entry, part, what takes its place) of a matrix and h.
    """

    def operator(matrix: Any, generator: random.Random, h: Any) -> Any:
        found = places(matrix, h)
        if not found:
            return None
        k, part, other = generator.choice(found)
        return _with_entry(matrix, k, matrix[k].xreplace({part: other}))

    return operator


def _letters(matrix: Any, h: Any) -> list[tuple[int, Any, Any]]:
    """A wrong index: in one entry, one letter of a vector stands for another of the same vector."""
    everywhere = sorted(set().union(*(f.free_symbols for f in matrix)), key=str)
    found = []
    for k, e in enumerate(matrix):
        for s in sorted((s for s in e.free_symbols if s != h), key=str):
            name, _, index = str(s).rpartition("_")
            if name and index.isdigit():
                others = (t for t in everywhere if str(t).rpartition("_")[0] == name)
                found += [(k, s, t) for t in others if t != s]
    return found


def _forgotten(power: int) -> Callable[[Any, Any], list[tuple[int, Any, Any]]]:
    """That power of h in one entry, as if it were 1."""

    def places(matrix: Any, h: Any) -> list[tuple[int, Any, Any]]:
        return [(k, h**power, sympy.Integer(1)) for k, e in enumerate(matrix) if e.has(h**power)]

    return places


def _powers(matrix: Any, h: Any) -> list[tuple[int, Any, Any]]:
    """An exponent that is one too high."""
    return [(k, p, p * p.base) for k, e in enumerate(matrix)
            for p in sorted(e.atoms(sympy.Pow), key=str)]  # fmt: skip


def transpose(matrix: Any, generator: random.Random, h: Any) -> Any:
    """A square matrix, transposed."""
    square = matrix.shape[0] == matrix.shape[1] > 1
    return matrix.T if square else None


def swap_rows(matrix: Any, generator: random.Random, h: Any) -> Any:
    """Two rows exchanged."""
    if matrix.shape[0] < 2:
        return None
    i, j = generator.sample(range(matrix.shape[0]), 2)
    changed = matrix.copy()
    changed.row_swap(i, j)
    return changed


#: name → operator; each is one kind of slip
OPERATORS: dict[str, Operator] = {
    "sign": _term(lambda t, h: -t),
    "drop": _term(lambda t, h: 0 * t),
    "double": _term(_scaled("2")),
    "half": _term(_scaled("1/2")),
    "factor 1.01": _term(_scaled("101/100")),
    "times h": _term(lambda t, h: t * h),
    "over h": _term(lambda t, h: t / h),
    "no h": _exchange(_forgotten(1)),
    "no h²": _exchange(_forgotten(2)),
    "power": _exchange(_powers),
    "index": _exchange(_letters),
    "transposed": transpose,
    "rows": swap_rows,
}
