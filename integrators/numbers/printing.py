"""From expressions to straight-line Python, run on any kind of number.

One text serves machine code, numpy arrays, gmpy2 and mpmath: integers stay literal,
other constants are coefficients computed once in the arithmetic at hand.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from .arithmetic import FUNCTIONS
from .expression_graph import CALL, INVERSE, LEAF, POWER, PRODUCT, SUM, ExpressionGraph, Value
from .types import Expression

#: the binding strength of a text; one that is weaker than needed gets parentheses
_TERMS, _FACTORS, _FACTOR, _RAISED, _ATOM = range(5)


def code(expression: Expression) -> str:
    """Return the Python text of one expression: plain arithmetic, small powers as products.

    Rationals are R(p)/q, R being the number type of the arithmetic. Raises `BadInput` for functions
    that no arithmetic has.
    """
    graph = ExpressionGraph()
    return Texts(graph, {}).of(*graph.values([expression]))


class Texts:
    """The texts of a graph's values; names: node → its name, if it has one."""

    def __init__(self, graph: ExpressionGraph, names: Mapping[int, str]) -> None:
        self.graph, self.names = graph, names
        self._used: set[str] = set()  # the names and letters of the current text

    def of(self, value: Value) -> str:
        """Return the text of a value, with names for the parts that have one."""
        return self._text(value, _TERMS)

    def with_letters(self, values: Iterable[Value]) -> tuple[list[str], set[str]]:
        """Return (the texts of values, the names and letters in them)."""
        self._used = set()
        return list(map(self.of, values)), self._used

    def inside(self, node: int) -> tuple[list[str], set[str]]:
        """Return (the text behind a node's name, the names and letters in it)."""
        self._used = set()
        return [self._written(node, 0)[0]], self._used

    def _text(self, value: Value, needed: int) -> str:
        node, minus = divmod(value, 2)
        if node in self.names:
            name = self.names[node]
            self._used.add(name)
            text, holds = (f"-{name}", _TERMS) if minus else (name, _ATOM)
        else:
            text, holds = self._written(node, minus)
        return text if holds >= needed else f"({text})"

    def _written(self, node: int, minus: int) -> tuple[str, int]:
        """Return the text of a node or of its opposite, and its binding strength."""
        kind, parts = self.graph.kinds[node], self.graph.parts[node]
        if kind == SUM and len(parts) > 1:
            return self._sum([p ^ minus for p in parts]), _TERMS
        if kind == SUM:
            return self._text(parts[0] ^ minus, _TERMS), _TERMS
        if kind == LEAF:
            text, holds = self.graph.details[node], _ATOM
            self._used.add(text)
        elif kind == PRODUCT:
            text, holds = self._product(parts), _FACTORS
        elif kind == INVERSE:
            text, holds = f"1/{self._text(parts[0], _RAISED)}", _FACTOR
        elif kind == POWER:
            text, holds = (
                "**".join([self._text(parts[0], _ATOM), self._text(parts[1], _ATOM)]),
                _RAISED,
            )
        else:
            assert kind == CALL
            text, holds = self._call(self.graph.details[node], parts), _ATOM
        return (f"-{text}", _TERMS) if minus else (text, holds)

    def _sum(self, terms: list[Value]) -> str:
        terms.sort(key=lambda term: term % 2)  # a positive term first
        text = self._text(terms[0], _FACTORS if terms[0] % 2 == 0 else _TERMS)
        for term in terms[1:]:
            text += f" {'-' if term % 2 else '+'} {self._text(term & ~1, _FACTORS)}"
        return text

    def _product(self, factors: list[Value]) -> str:
        """Return factors over factors."""
        graph, below, above = self.graph, [], []
        for f in factors:
            node = f >> 1
            if node not in self.names and graph.kinds[node] == INVERSE:
                below.append(graph.parts[node][0])
            else:
                above.append(f)
        text = "*".join(self._text(f, _FACTOR) for f in above) or "1"
        if below:
            texts = [self._text(f, _RAISED) for f in below]
            text += f"/{texts[0]}" if len(texts) == 1 else f"/({'*'.join(texts)})"
        return text

    def _call(self, e: Expression | str, parts: list[Value]) -> str:
        if isinstance(e, str):
            return f"{e}({self.of(parts[0])})"
        if hasattr(e, "written"):
            texts = dict(zip(e.args, map(self.of, parts), strict=True))
            return str(e.written(texts.__getitem__))
        name = type(e).__name__
        return f"{FUNCTIONS.get(name, name)}({', '.join(map(self.of, parts))})"
