"""Unknowns that their rows give one after another, so that nothing has to be solved.

A row w − g(…) = 0 gives w, if g needs only unknowns that other rows give before. If all rows of a
step are such rows, in some order, as the stages of Störmer–Verlet on a separable scene are, the
step is explicit: g is written out in the state alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..numbers import replaced, symbols_of, sympy
from ..numbers.types import Column, Expression, Letter
from .symbols import column

#: operations of the result beyond which a step stays implicit: its text would cost more than an
#: iteration
MOST = 20_000


@dataclass(frozen=True)
class ExplicitRows:
    """w, the unknowns that are kept; values: these, in the letters of the state alone.

    increment, gain: in w, in the state and in y. A function of x alone, such as a force, is not
    kept as an unknown: a kernel has its costly functions from the step before.
    """

    w: Column
    values: Column
    increment: Column
    gain: Column


def explicit_rows(
    rows: Column, w: Column, new: Column, z: Column, y: Column, known: Mapping[Letter, Expression]
) -> ExplicitRows | None:
    """Return the rows as formulas, and the growth of z; None if some unknown has to be solved for.

    new: the state after the step, z before, y: letters of the first entries of the new one; known:
    the values of other letters.
    """
    values = dict(known)
    given: dict[Letter, Expression] = {}
    for letter, row in zip(w, rows, strict=True):
        rest = letter - row
        if letter in symbols_of([rest]):
            return None
        given[letter] = rest
    found = _written_out(list(w), values | given, {})
    if found is None:
        return None
    moving = {*z[len(y) :]}
    kept = [e for e, value in zip(w, found, strict=True) if symbols_of([value]) & moving]
    if not kept:
        return None
    values |= {e: value for e, value in zip(w, found, strict=True) if e not in kept}
    grown = [a - b for a, b in zip(new, z, strict=True)]
    n = len(y)
    increment = _written_out(grown[:n], values, {})
    if increment is None:
        return None
    # the end point of a step is y, whose functions the next step needs again
    ends = {a + e: b for a, e, b in zip(z, increment, y, strict=False)}
    gain = _written_out(grown[n:], values, ends)
    if gain is None:
        return None
    formulas = dict(zip(w, found, strict=True))
    return ExplicitRows(
        column(kept), column([formulas[e] for e in kept]), column(increment), column(gain)
    )


def _written_out(
    wanted: Sequence[Expression], values: dict[Letter, Expression],
    named: dict[Expression, Expression],
) -> list[Expression] | None:  # fmt: skip
    """Return expressions without the letters that have values; None if recursive, or too long.

    named: values that have letters of their own.
    """
    known: dict[Expression, Expression] = {}
    pending: set[Letter] = set()

    def of(letter: Letter) -> Expression | None:
        if letter not in known:
            if letter in pending:  # it needs itself
                return None
            pending.add(letter)
            if not all(of(e) is not None for e in symbols_of([values[letter]]) & values.keys()):
                return None
            value = replaced([values[letter]], known.copy())[0]
            known[letter] = named.get(value, value)
        return known[letter]

    for e in symbols_of(wanted) & values.keys():
        if of(e) is None:
            return None
    found = replaced(wanted, known.copy())
    return found if sum(sympy.count_ops(e) for e in found) <= MOST else None
