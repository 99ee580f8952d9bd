"""Savings in a step's kernels: work that its equations do not need.

They are decided once, when kernels are generated, so that a step decides nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial

import numpy as np

from ..numbers import Node, node_values, random_point, sympy, vanishes
from ..numbers.nodes import CALL, HELD, LETTER, PRODUCT, RESULT
from ..numbers.types import Exact, Letter, Number
from .step import Step

#: name → explanation of each saving
SAVINGS = {
    "direct": "no Newton iteration where the equations of a step are affine in u",
    "coefficients": "what depends on the step and the parameters alone is computed once a flow",
    "carried": "costly functions of x at the end of a step are handed on to the next",
}
TRIES = 8  # pairs of points: at some the rows may have no value, a root of what is negative
#: units of length: in one that is 10²⁰ times longer or shorter than the motion's, what changes may
#: be lost beside what does not, as the fourth power of a short length and exp(−x²) of a long one
UNITS = (-160, -120, -80, -40, 40, 80, 120, 160)  # powers of 10


def is_affine(step: Step) -> bool:
    """Return True if the rows, with derivative `slope`, are affine in w and finite at w = 0.

    Then one correction solves them. The test compares the slope at two random w, with x, h and
    parameters unchanged; where the rows have no value at either, it tries elsewhere. It does so in
    all units of length, for x and w alike.
    """
    entries = [e for row in step.slope for e in row]
    moving = step.graph.depending(entries, set(step.graph.letters(step.w)))
    for seed in range(0, 2 * TRIES, 2):
        point, second = _pair(step, seed)
        for some in moving[:1], moving[1:]:  # one that changes tells
            if not _same(step, some, point, second):
                return False
        if _has_value(step, {**point, **dict.fromkeys(step.w, 0)}):
            pairs = [_pair(step, seed, unit) for unit in UNITS]  # some have no value: cosh(1e40)
            return all(_same(step, moving, *pair) for pair in pairs
                       if all(_has_value(step, one) for one in pair))  # fmt: skip
        if _has_value(step, point):
            return False
    return False


def _pair(step: Step, seed: int, unit: int = 0) -> list[dict[Letter, Exact]]:
    """Return two points that differ in w, of lengths of about 10^unit."""
    long = {*step.x, *step.w}
    first, other = ({e: v * sympy.Integer(10) ** unit if e in long else v
                     for e, v in _point(step, seed + k).items()} for k in (0, 1))  # fmt: skip
    return [first, {**first, **{e: other[e] for e in step.w}}]


def _has_value(step: Step, point: Mapping[Letter, Exact]) -> bool:
    """Return True if the rows and their slope are finite at a point."""
    try:
        values = _at(step, point, 30, step.system)
    except ZeroDivisionError:
        return False
    return all(v - v == 0 for v in values)


def _same(
    step: Step, entries: Sequence[Node], first: Mapping[Letter, Exact],
    second: Mapping[Letter, Exact],
) -> bool:  # fmt: skip
    """Return True if entries have the same values at two points."""

    def changes(digits: int, entries: Sequence[Node]) -> list[Number]:
        """Return the differences of entries between the two points."""
        ends = (_at(step, point, digits, entries) for point in (first, second))
        return [a - b for a, b in zip(*ends, strict=True)]

    differences = [(a, e) for a, e in zip(changes(60, entries), entries, strict=True) if a]
    for some in differences[:1], differences[1:]:  # one that is no round-off tells
        short, entries = [a for a, _ in some], [e for _, e in some]
        if any(abs(a) < 2 * abs(b) for a, b in zip(short, changes(100, entries), strict=True)):
            return False  # round-off would have lost 40 digits; 400 digits cost ten times as much
        long = changes(400, entries) if some else []
        if not all(vanishes(a, partial(abs, b)) for a, b in zip(short, long, strict=True)):
            return False
    return True


def pivot_rows(step: Step) -> list[int]:
    """Return the order of rows in which elimination meets large pivots at a random point.

    So a step need not search for pivots; if the order is poor, Newton only takes more corrections.
    With multipliers it is the order of the equations: first the mass matrix, then A M⁻¹ Aᵀ, since
    an entry of A that is large at one point is zero at another (`has_pivots`).
    """
    m = len(step.w)
    rows = list(range(m))
    if m <= 3 or step.multipliers:
        return rows
    left = _sample(step)
    for p in range(m):
        best = p + int(np.argmax(abs(left[p:, p])))
        rows[p], rows[best] = rows[best], rows[p]
        left[[p, best]] = left[[best, p]]
        if left[p, p]:
            left[p + 1 :] -= np.outer(left[p + 1 :, p] / left[p, p], left[p])
    return rows


def has_pivots(step: Step) -> bool:
    """Return False if equations with multipliers meet a pivot that is zero everywhere.

    If the mass matrix is definite, no pivot vanishes anywhere: its own have one sign, and so have
    those of A M⁻¹ Aᵀ. Otherwise some may vanish at single points, which `KernelsAtStep` handles.
    """
    if not step.multipliers:
        return True
    left = _sample(step)
    for p in range(len(left)):
        if abs(left[p, p]) < 1e-9 * abs(left[p]).max():  # only round-off is left
            return False
        left[p + 1 :] -= np.outer(left[p + 1 :, p] / left[p, p], left[p])
    return True


def _sample(step: Step) -> np.ndarray:
    """Return the slope at a random point, in double precision, (m, m)."""
    entries, m = [e for row in step.slope for e in row], len(step.w)
    values = _at(step, _point(step), 17, entries)
    return np.array(values, dtype=float).reshape(m, m)


def _point(step: Step, seed: int = 0) -> dict[Letter, Exact]:
    """Return a random point of x, w, q and μ, with a small step and small unknowns."""
    small = (*step.w, step.q[0])
    return {**random_point([*step.x, *step.w, *step.q], small=small, seed=seed),
            **random_point(step.mu)}  # fmt: skip


def _at(
    step: Step, point: Mapping[Letter, Exact], digits: int, entries: Sequence[Node]
) -> list[Number]:
    """Return the values of nodes at a point, computed with the given digits."""
    constants = {s: of(digits + 20) for s, of in step.constants.items()}
    return node_values(entries, {**point, **constants}, digits)


def carried(step: Step) -> list[tuple[Node, Node]]:
    """Return costly functions of x in the rows that the gain needs at the end: [(at x, at y)]."""
    graph = step.graph
    x, y, constants = map(graph.letters, (step.x, step.y, step.q[1:]))  # the next h may be another
    old = _costly(step.system, {*x}, {*constants})
    new = set(_costly(step.gain, {*y}, {*constants}))
    ends = graph.rebuilt(old, dict(zip((e.index for e in x), y, strict=True)))
    return [(a, b) for a, b in zip(old, ends, strict=True) if b in new]


def _costly(entries: Iterable[Node], variables: set[Node], constants: set[Node]) -> list[Node]:
    """Return largest nodes that are functions or roots of `variables` and constants."""
    terms: dict[Node, None] = {}
    visited: set[Node] = set()
    letters: dict[Node, frozenset[Node]] = {}

    def held(e: Node) -> frozenset[Node]:
        if e not in letters:
            own = e.kind in (LETTER, HELD, RESULT)
            below = [e] if own else [a for part in e.graph.below(e) for a in held(part)]
            letters[e] = frozenset(below)
        return letters[e]

    def visit(e: Node) -> None:
        if e in visited or not held(e) & variables:
            return
        visited.add(e)
        graph = e.graph
        parts = [(graph.nodes[i], n) for i, n in e.args] if e.kind == PRODUCT else []
        whole = {a for a, n in parts if n > 0 and n.denominator == 1}
        costly = [(a, graph.product([(a, n)])) for a, n in parts if a not in whole]
        costly += [(e, e)] if e.kind == CALL else []
        for a, term in costly:
            if held(term) & variables and held(term) <= variables | constants:
                terms[term] = None
                visited.add(a)
        if e not in terms and e.kind not in (HELD, RESULT):
            for a in graph.below(e):
                visit(a)

    for entry in entries:
        visit(entry)
    return list(terms)
