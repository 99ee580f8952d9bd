"""Values that depend on the step and the parameters alone: computed once per flow, by letters."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from .arithmetic import refused
from .graph import Graph
from .lazy import sympy
from .nodes import CONSTANT, LETTER, NUMBER, RESULT, Node
from .types import Letter, Letters


class Coefficients:
    """Values of the step and the parameters `q` alone, each computed once per flow as c[i].

    Sums are not multiplied out: c·(a − c′b) keeps its map volume-preserving in rounded numbers,
    where c·a − (cc′)·b would let energy drift linearly (harmonic midpoint: 3e-19 a step). graph:
    that of the values; those of other graphs are copied. plain: the parameters themselves are the
    coefficients, and kernels compute the rest anew.
    """

    def __init__(self, q: Letters, graph: Graph | None = None, plain: bool = False) -> None:
        self.q, self.graph, self.plain = list(q), graph or Graph(), plain
        self.values: list[Node] = self.graph.letters(q) if plain else []
        self._parameters = set(q)
        self._places: dict[int, int] = {}
        self._constant: dict[Node, bool] = {}

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the coefficients that have been asked for so far."""
        return (f"c{i}" for i in range(len(self.values)))

    def look_at(self, graph: Graph, nodes: Sequence[Node]) -> None:
        """Find out which of these nodes, and of those below, are constant."""
        known = self._constant
        for e in graph.order(nodes, known.__contains__):
            if e not in known:
                free = e.kind == RESULT or (e.kind == LETTER and e.args not in self._parameters)
                known[e] = not (free or self.plain) and all(map(known.get, graph.below(e)))

    def constant(self, e: Node) -> bool:
        """Return True if all letters in a node are of q."""
        found = self._constant.get(e)
        if found is None:
            self.look_at(e.graph, [e])
            found = self._constant[e]
        return found

    def place(self, e: Node) -> tuple[int, bool]:
        """Return (i, True for a minus sign) of a constant node, which is c[i] or −c[i].

        Raises `BadInput` for a complex coefficient.
        """
        if e.graph is not self.graph:
            (e,) = self.graph.rebuilt([e], {})
        minus = e.leads_negative or (e.kind == NUMBER and e.args < 0)
        e = -e if minus else e
        if e.index not in self._places:
            if any(a.kind == CONSTANT and a.args.has(sympy.I) for a in self.graph.order([e])):
                raise refused(sympy.I)
            self._places[e.index] = len(self.values)
            self.values.append(e)
        return self._places[e.index], minus

    def symbol(self, letter: Letter) -> int:
        """Return the place of a parameter among the coefficients."""
        return self.place(self.graph.letter(letter))[0]
