"""Savings in a system's kernels: work that its equations do not need.

They are decided once, when kernels are generated, so that a step decides nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial

import numpy as np

from ..numbers import evaluate_at, needed, random_point, symbols_of, vanishes
from ..numbers.types import Expression, Letter, Letters, Number, Replacement
from .step import Step

#: name → explanation of each saving
SAVINGS = {
    "direct": "no Newton iteration where the equations of a step are affine in u",
    "coefficients": "what depends on the step and the parameters alone is computed once a flow",
    "carried": "costly functions of x at the end of a step are handed on to the next",
}


def is_affine(system: Step) -> bool:
    """Return True if the rows, with derivative `slope`, are affine in w.

    Then one correction solves them. The test compares the slope at two random w, with x, h and
    parameters unchanged.
    """
    letters = {*system.w, *(z for d in system.definitions for z in d.letters)}
    if not symbols_of(system.slope) & letters:
        return True
    symbols, small = [*system.x, *system.w, *system.q], (*system.w, system.q[0])
    first, other = (random_point(symbols, small=small, seed=i) for i in (0, 1))
    first |= random_point(system.mu)
    second = {**first, **{u: other[u] for u in system.w}}

    def changes(digits: int, entries: Sequence[Expression]) -> list[Number]:
        """Return the differences of entries between the two points."""
        ends = (_at(system, point, digits, entries) for point in (first, second))
        return [a - b for a, b in zip(*ends, strict=True)]

    entries = list(system.slope)
    found = [(a, e) for a, e in zip(changes(60, entries), entries, strict=True) if a]
    for some in found[:1], found[1:]:  # one that is no round-off tells
        short, entries = [a for a, _ in some], [e for _, e in some]
        long = changes(400, entries) if some else []
        if not all(vanishes(a, partial(abs, b)) for a, b in zip(short, long, strict=True)):
            return False
    return True


def pivot_rows(system: Step) -> list[int]:
    """Return the order of rows in which elimination meets large pivots at a random point.

    So a step need not search for pivots; if the order is poor, Newton only takes more corrections.
    With multipliers it is the order of the equations: first the mass matrix, then A M⁻¹ Aᵀ, since
    an entry of A that is large at one point is zero at another (`has_pivots`).
    """
    m = len(system.w)
    rows = list(range(m))
    if m <= 3 or system.multipliers:
        return rows
    left = _sample(system)
    for p in range(m):
        best = p + int(np.argmax(abs(left[p:, p])))
        rows[p], rows[best] = rows[best], rows[p]
        left[[p, best]] = left[[best, p]]
        if left[p, p]:
            left[p + 1 :] -= np.outer(left[p + 1 :, p] / left[p, p], left[p])
    return rows


def has_pivots(system: Step) -> bool:
    """Return False if equations with multipliers meet a pivot that is zero everywhere.

    If the mass matrix is definite, no pivot vanishes anywhere: its own have one sign, and so have
    those of A M⁻¹ Aᵀ. Otherwise some may vanish at single points, which `KernelsAtStep` handles.
    """
    if not system.multipliers:
        return True
    left = _sample(system)
    for p in range(len(left)):
        if abs(left[p, p]) < 1e-9 * abs(left[p]).max():  # only round-off is left
            return False
        left[p + 1 :] -= np.outer(left[p + 1 :, p] / left[p, p], left[p])
    return True


def _sample(system: Step) -> np.ndarray:
    """Return the slope at a random point, in double precision, (m, m)."""
    m, small = len(system.w), (*system.w, system.q[0])
    point = random_point([*system.x, *system.w, *system.q], small) | random_point(system.mu)
    return np.array(_at(system, point, 17, list(system.slope)), dtype=float).reshape(m, m)


def carried(system: Step) -> list[tuple[Expression, Expression]]:
    """Return costly functions of x in the rows that the gain needs at the end: [(at x, at y)]."""
    to_end = dict(zip(system.x, system.y, strict=True))
    constants = set(system.q[1:])  # the next step may be of another size
    old = _costly([*system.rows, *system.slope], system.x, constants)
    new = _costly(system.gain, system.y, constants)
    return [(a, a.xreplace(to_end)) for a in old if a.xreplace(to_end) in new]


def _at(
    system: Step, point: Replacement, digits: int, entries: Sequence[Expression]
) -> list[Number]:
    """Return entries of the slope at a point, computed with the given digits."""
    constants = {s: of(digits + 20) for s, of in system.constants.items()}
    used = needed(system.definitions, entries)
    return evaluate_at(entries, {**point, **constants}, digits, used)


def _costly(
    entries: Iterable[Expression], variables: Letters, constants: set[Letter]
) -> list[Expression]:
    """Return largest subexpressions that are functions or roots of `variables` and constants."""
    wanted = set(variables)
    terms: list[Expression] = []
    visited: set[Expression] = set()
    letters: dict[Expression, frozenset[Letter]] = {}  # sympy looks at shared parts again

    def held(e: Expression) -> frozenset[Letter]:
        if e not in letters:
            letters[e] = frozenset({e}) if e.is_Symbol else frozenset().union(*map(held, e.args))
        return letters[e]

    def visit(e: Expression) -> None:
        if e in visited or not held(e) & wanted:
            return
        visited.add(e)
        costly = e.is_Function or (e.is_Pow and not (e.exp.is_Integer and e.exp > 0))
        if costly and held(e) <= wanted | constants:
            if e not in terms:
                terms.append(e)
            return
        for a in e.args:
            visit(a)

    for entry in entries:
        visit(entry)
    return terms
