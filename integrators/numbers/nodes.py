"""The nodes of a graph of expressions, and the numbers in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, TypeAlias

from .lazy import LazyModule, sympy
from .types import Expression, Letter

gmpy2: Any = LazyModule("gmpy2")

NUMBER, LETTER, CONSTANT, SUM, PRODUCT, CALL, HELD, RESULT = range(8)

#: a rational number: an int, or `ratio` of two
Rational: TypeAlias = Any
#: {place of a letter in a variable: derivative by it}, without zeros
Row: TypeAlias = "dict[int, Node]"
Nodes: TypeAlias = "Sequence[Node]"
NodeMatrix: TypeAlias = "list[list[Node]]"


class Node:
    """An expression of a graph; `args` by kind:

    NUMBER: the number. LETTER, CONSTANT: the sympy expression. SUM: (constant, ((index,
    coefficient), …)). PRODUCT: ((index of a base, rational exponent), …). CALL: (a function of
    slots, indices of its arguments). HELD: (its `Group`, place in it). RESULT: (a call, which has
    `arguments`, its `function` and `partials(number)`, the number of the result).
    """

    __slots__ = ("args", "graph", "index", "kind")

    def __init__(self, graph: Any, kind: int, args: Any, index: int) -> None:
        self.graph, self.kind, self.args, self.index = graph, kind, args, index

    def __add__(self, other: Any) -> Node:
        return self.graph.sum([(1, self), (1, self.graph.node(other))])

    def __sub__(self, other: Any) -> Node:
        return self.graph.sum([(1, self), (-1, self.graph.node(other))])

    def __neg__(self) -> Node:
        return self.graph.sum([(-1, self)])

    def __mul__(self, other: Any) -> Node:
        return self.graph.product([(self, 1), (self.graph.node(other), 1)])

    __radd__, __rmul__ = __add__, __mul__

    def __bool__(self) -> bool:
        return self.kind != NUMBER or self.args != 0

    @property
    def is_number(self) -> bool:
        """Return True for a rational number."""
        return self.kind == NUMBER

    @property
    def is_letter(self) -> bool:
        """Return True for a letter that does not stand for another node."""
        return self.kind == LETTER

    @property
    def leads_negative(self) -> bool:
        """Return True for a sum whose first term has a negative coefficient."""
        return self.kind == SUM and self.args[1][0][1] < 0

    @property
    def scaled(self) -> tuple[Rational, Node]:
        """Return (c, e) where the node is c·e with a number c; c = 1 for a sum of several terms."""
        if self.kind == SUM and not self.args[0] and len(self.args[1]) == 1:
            ((index, c),) = self.args[1]
            return c, self.graph.nodes[index]
        return 1, self

    def fraction(self) -> tuple[Node, Node]:
        """Return (N, D) with N/D equal to the node; D is the product of its denominators."""
        above, below = self._over_powers()
        nodes = self.graph.nodes
        return above, self.graph.product((nodes[i], n) for i, n in below.items())

    def _over_powers(self) -> tuple[Node, dict[int, Rational]]:
        """Return (N, {index of a denominator: its power})."""
        graph, nodes, powers = self.graph, self.graph.nodes, dict[int, Rational]()
        if self.kind == PRODUCT:
            factors: list[tuple[Node, Rational]] = []
            for i, n in self.args:
                if n < 0 and n.denominator == 1:
                    powers[i] = powers.get(i, 0) - n
                elif n == 1:
                    above, below = nodes[i]._over_powers()
                    factors.append((above, 1))
                    for k, p in below.items():
                        powers[k] = powers.get(k, 0) + p
                else:
                    factors.append((nodes[i], n))
            return graph.product(factors), powers
        if self.kind != SUM:
            return self, {}
        parts = [(c, *nodes[i]._over_powers()) for i, c in self.args[1]]
        for _, _, below in parts:
            for k, p in below.items():
                powers[k] = max(powers.get(k, 0), p)
        whole = []
        for c, above, below in [(self.args[0], graph.one, {}), *parts]:
            missing = ((nodes[k], p - below.get(k, 0)) for k, p in powers.items())
            whole.append((c, graph.product([(above, 1), *missing])))
        return graph.sum(whole), powers

    def __repr__(self) -> str:
        return str(self.graph.shown(self))


@dataclass(eq=False)
class Group:
    """Nodes that are held together: `letters` are their names, `values` their values.

    partials: [(nodes that the values depend on, the matrix of derivatives by these)], where these
    are not derived from the values; a matrix may be a function that makes it when it is asked for.
    symmetry: where the values are ⟨g, A_i⟩, a gradient along directions: these, and the matrix C
    with A_a⟨g, A_i⟩ = A_i⟨g, A_a⟩ + C_ia for a < i, so that half of the derivatives are known.
    quotients: where the values are quotients, (N, D) of each. scope: None for values that are held
    only so that they are computed by themselves.
    """

    scope: Any
    letters: Sequence[Letter]
    values: list[Node]
    partials: list[tuple[Nodes, Any]] | None = None
    symmetry: tuple[list[Node], NodeMatrix] | None = None
    nodes: list[Node] = field(default_factory=list)
    quotients: list[tuple[Node, Node]] = field(default_factory=list)
    named: bool = True


@dataclass(eq=False)
class Call:
    """A call of a function of several results: `function` has their nodes `results` in its own
    letters `arguments`, a `name` and the `scope` of the nodes that are held in it."""

    function: Any
    arguments: Sequence[Node]


_SLOTS: list[Letter] = []


def slot(place: int) -> Letter:
    """Return the letter that stands for an argument of a function."""
    while len(_SLOTS) <= place:
        _SLOTS.append(sympy.Dummy(f"slot{len(_SLOTS)}", real=True))
    return _SLOTS[place]


def ratio(above: Rational, below: int = 1) -> Rational:
    """Return the rational number above/below, of which a graph hashes many."""
    return gmpy2.mpq(above, below)


def reduced(value: Rational) -> Rational:
    """Return a number, as an int if it is whole."""
    return int(value.numerator) if value.denominator == 1 else value


@lru_cache(maxsize=4096)
def rational(value: Rational) -> Expression:
    return sympy.Rational(int(value.numerator), int(value.denominator))
