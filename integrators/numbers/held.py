"""Nodes that stand for others, and derivatives through them.

A held node stands for its value without being merged into the sums and products around it. So a
value that many others use is computed and differentiated in one place: the rows of its derivatives
are held, too. In sympy it is a letter with a `Definition`. Its `Group` says more of its derivatives
where more is known (a point that moves along ρ, a gradient whose derivative is symmetric).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from .graph import Graph
from .lazy import sympy
from .nodes import (
    CALL,
    HELD,
    LETTER,
    NUMBER,
    PRODUCT,
    RESULT,
    SUM,
    Group,
    Node,
    NodeMatrix,
    Nodes,
    Rational,
    Row,
    Slopes,
)
from .types import Entries, Expression, Letter, Letters, SymbolicMatrix


@dataclass(eq=False)
class Frame:
    """The directions ζ in which a point of more coordinates moves: dζ = slope · d(by)."""

    letters: list[Node]
    by: list[Node]
    slope: NodeMatrix


class Scope:
    """The held nodes of one step, or of one function: groups and calls, in order of creation."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.parts: list[Any] = []
        self.frames: list[Frame] = []
        #: nodes that are held elsewhere and are letters here
        self.given: list[Node] = []
        self._held: dict[Hashable, Node] = {}
        #: known derivatives, by the variable
        self._rows: dict[tuple[int, ...], dict[int, Row]] = {}

    def group(
        self,
        letters: Sequence[Letter],
        values: Sequence[Node],
        partials: list[tuple[Nodes, Slopes]] | None = None,
        named: bool = True,
    ) -> list[Node]:
        """Hold values under letters and return the nodes that stand for them.

        named: True if rows of their derivatives are held, too: the values are sums over many nodes.
        """
        made = Group(self, list(letters), list(values), partials, named=named)
        return self._append(made)

    def _append(self, group: Group) -> list[Node]:
        self.append(group)
        group.nodes = [self.graph.make(HELD, (group, i)) for i in range(len(group.values))]
        self.graph.name(group.letters, group.nodes)
        return group.nodes

    def held(self, values: Sequence[Node], name: str, named: bool = True) -> list[Node]:
        """Hold values that are sums, products or functions, equal ones once; return all values."""
        new = {v.index: v for v in values if v.kind in (SUM, PRODUCT, CALL)}
        new = {i: v for i, v in new.items() if i not in self._held}
        if new:
            made = self.group(self.names(name, len(new)), list(new.values()), named=named)
            self._held |= zip(new, made, strict=True)
        return [self._held.get(v.index, v) for v in values]

    def held_sums(self, values: Sequence[Node]) -> list[Node]:
        """Hold the values that are sums of several terms; return all of them."""
        sums = [v for v in values if v.kind == SUM and (v.args[0] or len(v.args[1]) > 1)]
        nodes = {v.index: e for v, e in zip(sums, self.held(sums, "f"), strict=True)}
        return [nodes.get(v.index, v) for v in values]

    def names(self, letter: str, count: int) -> list[Letter]:
        """Return letters that the graph does not have yet."""
        prefix = f"{letter}{self.graph.parts}"
        return [sympy.Symbol(f"{prefix}_{i}", real=True) for i in range(count)]

    def append(self, part: Any) -> None:
        """Append a group, or a call whose results have letters; both have a `definition`."""
        self.parts.append(part)
        self.graph.parts += 1

    def quotients(self, above: Sequence[Node], below: Sequence[Node], name: str) -> list[Node]:
        """Hold N/D, whose derivatives (∂N − (N/D) ∂D)/D are quotients of the same kind.

        1/D is held too, so that rational derivatives stay small.
        """
        keys = [(n.index, d.index) for n, d in zip(above, below, strict=True)]
        new = [i for i, key in enumerate(keys) if key not in self._held and above[i]]
        if new:
            over = [self._inverse(below[i]) for i in new]
            pairs = zip(new, over, strict=True)
            values = [self.graph.product([(above[i], 1), (o, 1)]) for i, o in pairs]
            ratios = [(above[i], below[i]) for i in new]
            made = self._append(Group(self, self.names(name, len(new)), values, quotients=ratios))
            self._held |= {keys[i]: node for i, node in zip(new, made, strict=True)}
        return [self._held[key] if n else n for key, n in zip(keys, above, strict=True)]

    def _inverse(self, below: Node) -> Node:
        key = ("inverse", below.index)
        if key not in self._held:
            value = self.graph.product([(below, -1)])
            if value.kind == NUMBER:
                return value
            group = Group(self, self.names("o", 1), [value], named=False)
            (made,) = self._append(group)
            square = [[self.graph.product([(made, 2)], -1)]]
            group.partials = [([below], square)]
            self._held[key] = made
        return self._held[key]

    def total(self, column: Entries, variable: Letters) -> SymbolicMatrix:
        """Return d(column)/d(variable), all in sympy; the variable is a column of letters."""
        g = self.graph
        rows = self.jacobian(g.column(column), g.letters(variable))
        return sympy.Matrix(len(rows), len(variable), [g.shown(e) for row in rows for e in row])

    def jacobian(self, nodes: Sequence[Node], by: Sequence[Node]) -> NodeMatrix:
        """Return ∂nodes/∂by, a row for each node, through all held nodes.

        A point of many coordinates moves in fewer directions: derivatives are taken along these
        (`Frame`) and then multiplied by their slope.
        """
        g, width = self.graph, len(by)
        moved = {e.index for e in by}
        assert not moved & g.fixed, "the step and the parameters are taken for constants"
        frames = [f for f in self.frames if moved & {e.index for e in f.by}]
        seeds = [*by, *(e for f in frames for e in f.letters)]
        rows = [self.row(e, seeds) for e in nodes]
        result = []
        for row in rows:
            terms: list[list[tuple[Rational, Node]]] = [[] for _ in by]
            for j, e in row.items():
                if j < width:
                    terms[j].append((1, e))
            at = width
            for f in frames:
                place = {e.index: k for k, e in enumerate(f.by)}
                for k in range(len(f.letters)):
                    if (along := row.get(at + k)) is None:
                        continue
                    for j, e in enumerate(by):
                        if e.index in place and (slope := f.slope[k][place[e.index]]):
                            terms[j].append((1, g.product([(along, 1), (slope, 1)])))
                at += len(f.letters)
            result.append([g.sum(t) for t in terms])
        return result

    def row(self, node: Node, seeds: Sequence[Node]) -> Row:
        """Return {place: ∂node/∂seed} for the seeds that the node depends on."""
        key = tuple(e.index for e in seeds)
        if key not in self._rows:
            apart: dict[int, Row] = {e.index: {} for e in self.given}
            self._rows[key] = apart | {i: {j: self.graph.one} for j, i in enumerate(key)}
        return self._row(node, self._rows[key])

    def _row(self, node: Node, known: dict[int, Row]) -> Row:
        row = known.get(node.index)
        if row is None:
            row = known[node.index] = self._derived(node, known)
        return row

    def _derived(self, node: Node, known: dict[int, Row]) -> Row:
        g = self.graph
        if node.kind == HELD:
            return self._of_held(node, known)
        if node.kind == RESULT:
            call, number = node.args
            return g.combined([(1, *pair) for pair in self._through(call.partials(number), known)])
        if node.kind == LETTER:
            return {}
        parts = [(e, self._row(g.nodes[i], known)) for i, e in g.slopes(node).items()]
        return g.combined([(1, e, row) for e, row in parts if row])

    def _through(
        self, partials: Iterable[tuple[Nodes, Callable[[], Sequence[Node]]]], known: dict[int, Row]
    ) -> list[tuple[Node, Row]]:
        pairs = []
        for by, slopes in partials:
            rows = [self._row(e, known) for e in by]
            if any(rows):
                pairs += [(s, row) for s, row in zip(slopes(), rows, strict=True) if row and s]
        return pairs

    def _of_held(self, node: Node, known: dict[int, Row]) -> Row:
        g, (group, place) = self.graph, node.args
        if group.quotients:
            return self._of_quotient(node, known)
        if group.partials is not None:
            partials = [(by, _rows_of(matrix, place)) for by, matrix in group.partials]
            row = g.combined([(1, s, row) for s, row in self._through(partials, known)])
        else:
            row = dict(self._row(group.values[place], known))
        if group.symmetry is not None:
            directions, commutators = group.symmetry
            for a in range(place):
                for j in known.get(directions[a].index, ()):
                    (own,) = known[directions[place].index]
                    other = self._row(group.nodes[a], known).get(own, g.number(0))
                    row[j] = other + commutators[place][a]
        row = {j: e for j, e in row.items() if e}
        if not group.named:
            return row
        return dict(zip(row, group.scope.held_sums(list(row.values())), strict=True))

    def _of_quotient(self, node: Node, known: dict[int, Row]) -> Row:
        g, (group, place) = self.graph, node.args
        above, below = group.quotients[place]
        over = group.scope._inverse(below)
        of_above, of_below = self._row(above, known), self._row(below, known)
        if not of_below:
            return g.combined([(1, over, of_above)])
        places = sorted({*of_above, *of_below})
        zero = g.number(0)
        tops = [
            of_above.get(j, zero) - node * of_below[j] if j in of_below else of_above[j]
            for j in places
        ]
        made = group.scope.quotients(tops, [below] * len(tops), "v")
        return {j: e for j, e in zip(places, made, strict=True) if e}


def _rows_of(matrix: Slopes, place: int) -> Callable[[], Sequence[Node]]:
    """Return a function that gives a row of a matrix."""

    def row() -> Sequence[Node]:
        whole = matrix() if callable(matrix) else matrix
        entries: Sequence[Node] = whole[place]
        return entries

    return row


def jacobian(column: Iterable[Expression], letters: Iterable[Letter]) -> SymbolicMatrix:
    """Return ∂(column)/∂(letters) in sympy, a matrix with a row for each entry of the column."""
    return Scope(Graph()).total(list(column), list(letters))
