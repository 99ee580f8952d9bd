"""Bounds of the round-off in the rows of a step, from all terms of the rows.

A row may be much smaller than its terms: the constraint of a pendulum at 30,000 lengths from the
origin has round-off of that place, whatever u and λ are. To first order a value is
off by at most kε·S: k is the number of roundings on its longest path, and S a running error bound
(Higham, Accuracy and Stability of Numerical Algorithms, 3.3): |value| of a letter, Σ|c|S of a sum,
and of products and functions what the S of each part moves them by.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..numbers import Graph, Node, Rational, sympy
from ..numbers.nodes import CALL, CONSTANT, HELD, LETTER, NUMBER, PRODUCT, RESULT, SUM, slot

#: roundings of a letter: u is written as hu/h; and of a function, which libraries give to one unit
#: in the last place
LETTERS, FUNCTIONS = 2, 2


def bounds(graph: Graph, rows: Sequence[Node]) -> list[Node]:
    """Return bounds of the round-off of rows, in units ε of round-off; a row that is 0 has 0."""
    known: dict[Node, tuple[Node, Rational]] = {}
    for e in graph.order(rows):
        _add(graph, e, known)
    return [graph.product([(size, 1)], k) for size, k in (known[e] for e in rows)]


def _add(graph: Graph, e: Node, known: dict[Node, tuple[Node, Rational]]) -> None:
    """Add (S, k) of a node to those that are known; those below it are."""
    kind, args, nodes = e.kind, e.args, graph.nodes
    if kind == NUMBER:
        known[e] = graph.number(abs(args)), 1
    elif kind in (LETTER, CONSTANT):
        known[e] = _absolute(graph, e), LETTERS
    elif kind == HELD:
        known[e] = known[graph.below(e)[0]]
    elif kind == RESULT:
        opened = graph.opened(e)
        for part in graph.order([opened], known.__contains__):
            if part not in known:
                _add(graph, part, known)
        known[e] = known[opened]
    elif kind == SUM:
        terms = [(abs(c), known[nodes[i]]) for i, c in args[1]]
        size = graph.sum([(abs(args[0]), graph.one), *((c, s) for c, (s, _) in terms)])
        known[e] = size, max(k for _, (_, k) in terms) + len(terms) + 1
    elif kind == PRODUCT:
        factors = [(nodes[i], n) for i, n in args]
        sizes = [(_absolute(graph, b), n) for b, n in factors]
        moved = (
            (abs(n), graph.product([(known[b][0], 1), (sizes[at][0], n - 1),
                                    *(pair for k, pair in enumerate(sizes) if k != at)]))
            for at, (b, n) in enumerate(factors)
        )  # fmt: skip
        known[e] = (
            graph.sum(moved),
            max(known[b][1] for b, _ in factors) + sum(-(-abs(n) // 1) for _, n in factors),
        )
    elif kind == CALL:
        below = [known[nodes[i]] for i in args[1]]
        slopes = (_absolute(graph, graph.slope(e, place)) for place in range(len(below)))
        moved = ((1, slope * s) for slope, (s, _) in zip(slopes, below, strict=True))
        known[e] = (graph.sum([(1, _absolute(graph, e)), *moved]),
                    max(k for _, k in below) + FUNCTIONS)  # fmt: skip


def _absolute(graph: Graph, e: Node) -> Node:
    return graph.make(CALL, (sympy.Abs(slot(0)), (e.index,)))
