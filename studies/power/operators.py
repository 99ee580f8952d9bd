"""Mutation operators: small slips of the pen in a symbolic expression, at a seeded place.

An operator takes a sympy matrix (or a scalar) and a random generator, and returns a changed copy,
or None where it finds no place. A place is an entry and, in it, a term of one of its sums.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from typing import Any

Operator = Callable[[Any, random.Random, Any], Any]
Path = tuple[int, ...]


def _sums(e: Any, path: Path = ()) -> Iterator[tuple[Path, Any]]:
    """Every sum inside an expression, with the arguments that lead there."""
    if e.is_Add:
        yield path, e
    for i, part in enumerate(e.args):
        yield from _sums(part, (*path, i))


def _replaced(e: Any, path: Path, new: Any) -> Any:
    if not path:
        return new
    parts = list(e.args)
    parts[path[0]] = _replaced(parts[path[0]], path[1:], new)
    return e.func(*parts)


def _term(change: Callable[[Any, Any], Any]) -> Operator:
    """An operator that changes one term of one sum; of an entry without sums, the entry."""

    def operator(matrix: Any, generator: random.Random, h: Any) -> Any:
        entries = [k for k, e in enumerate(matrix) if e != 0]
        if not entries:
            return None
        k = generator.choice(entries)
        places: list[tuple[Path, int]] = [
            (path, i) for path, e in _sums(matrix[k]) for i in range(len(e.args))
        ]
        path, i = generator.choice(places or [((), -1)])
        here = matrix[k]
        for step in path:
            here = here.args[step]
        if i < 0:
            new = change(here, h)
        else:
            terms = list(here.args)
            terms[i] = change(terms[i], h)
            new = here.func(*terms)
        return _with_entry(matrix, k, _replaced(matrix[k], path, new))

    return operator


def _with_entry(matrix: Any, k: int, value: Any) -> Any:
    changed = matrix.copy()
    changed[k] = value
    return changed


def _scaled(factor: str) -> Callable[[Any, Any], Any]:
    from fractions import Fraction

    def change(term: Any, h: Any) -> Any:
        from sympy import Rational

        ratio = Fraction(factor)
        return term * Rational(ratio.numerator, ratio.denominator)

    return change


def swap_letters(matrix: Any, generator: random.Random, h: Any) -> Any:
    """A wrong index: in one entry, one letter of a vector stands for another of the same vector."""
    places = []
    for k, e in enumerate(matrix):
        letters = sorted((s for s in e.free_symbols if s != h), key=str)
        everywhere = sorted(set().union(*(f.free_symbols for f in matrix)), key=str)
        for s in letters:
            name, _, index = str(s).rpartition("_")
            others = [
                t for t in everywhere
                if t != s and name and str(t).rpartition("_")[0] == name and index.isdigit()
            ]  # fmt: skip
            places += [(k, s, t) for t in others]
    if not places:
        return None
    k, s, t = generator.choice(places)
    return _with_entry(matrix, k, matrix[k].xreplace({s: t}))


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


def drop_h(matrix: Any, generator: random.Random, h: Any) -> Any:
    """The h of one entry forgotten (h = 1 there)."""
    places = [k for k, e in enumerate(matrix) if e.has(h)]
    if not places:
        return None
    k = generator.choice(places)
    return _with_entry(matrix, k, matrix[k].subs(h, 1))


def drop_h_squared(matrix: Any, generator: random.Random, h: Any) -> Any:
    """The h² of one entry forgotten."""
    from sympy import Integer

    places = [k for k, e in enumerate(matrix) if e.has(h**2)]
    if not places:
        return None
    k = generator.choice(places)
    return _with_entry(matrix, k, matrix[k].xreplace({h**2: Integer(1)}))


def wrong_power(matrix: Any, generator: random.Random, h: Any) -> Any:
    """An exponent that is one too high."""
    from sympy import Pow

    places = [(k, p) for k, e in enumerate(matrix) for p in sorted(e.atoms(Pow), key=str)]
    if not places:
        return None
    k, power = generator.choice(places)
    return _with_entry(matrix, k, matrix[k].xreplace({power: power * power.base}))


#: name → operator; each is one kind of slip
OPERATORS: dict[str, Operator] = {
    "sign": _term(lambda t, h: -t),
    "drop": _term(lambda t, h: 0 * t),
    "double": _term(_scaled("2")),
    "half": _term(_scaled("1/2")),
    "factor 1.01": _term(_scaled("101/100")),
    "times h": _term(lambda t, h: t * h),
    "over h": _term(lambda t, h: t / h),
    "no h": drop_h,
    "no h²": drop_h_squared,
    "power": wrong_power,
    "index": swap_letters,
    "transposed": transpose,
    "rows": swap_rows,
}
