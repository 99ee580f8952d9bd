"""The nodes of a graph of expressions, the numbers in them, and walks through nodes below others:
what is there, put in other places, or written out."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from hashlib import blake2b
from typing import Any, TypeAlias

from .lazy import LazyModule, sympy
from .types import Expression, Letter, SymbolicMatrix

gmpy2 = LazyModule("gmpy2")

NUMBER, LETTER, CONSTANT, SUM, PRODUCT, CALL, HELD, RESULT = range(8)

#: a rational number: an int, or `ratio` of two
Rational: TypeAlias = Any
#: {place of a letter in a variable: derivative by it}, without zeros
Row: TypeAlias = "dict[int, Node]"
Nodes: TypeAlias = "Sequence[Node]"
NodeMatrix: TypeAlias = "list[list[Node]]"
#: a matrix, or a function that makes it when it is asked for
Slopes: TypeAlias = "NodeMatrix | Callable[[], NodeMatrix]"


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

    def __add__(self, other: Expression | Node) -> Node:
        return self.graph.sum([(1, self), (1, self.graph.node(other))])

    def __sub__(self, other: Expression | Node) -> Node:
        return self.graph.sum([(1, self), (-1, self.graph.node(other))])

    def __neg__(self) -> Node:
        return self.graph.sum([(-1, self)])

    def __mul__(self, other: Expression | Node) -> Node:
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
        terms = self.terms
        return terms[0] if len(terms) == 1 else (1, self)

    @property
    def terms(self) -> list[tuple[Rational, Node]]:
        """Return [(c, e)] with numbers c and Σ c·e equal to the node; e = 1 of a constant."""
        if self.kind != SUM:
            return [(1, self)]
        constant, terms = self.args
        whole = [(c, self.graph.nodes[i]) for i, c in terms]
        return [(constant, self.graph.one), *whole] if constant else whole

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
        parts = [(c, *e._over_powers()) for c, e in self.terms]
        for _, _, below in parts:
            for k, p in below.items():
                powers[k] = max(powers.get(k, 0), p)
        whole = []
        for c, above, below in parts:
            missing = ((nodes[k], p - below.get(k, 0)) for k, p in powers.items())
            whole.append((c, graph.product([(above, 1), *missing])))
        return graph.sum(whole), powers

    def __repr__(self) -> str:
        return str(self.graph.shown(self))


@dataclass(eq=False)
class Group:
    """Nodes that are held together: `letters` are their names, `values` their values.

    partials: [(nodes that the values depend on, the matrix of derivatives by these)], where these
    are not derived from the values.
    symmetry: where the values are ⟨g, A_i⟩, a gradient along directions: these, and the matrix C
    with A_a⟨g, A_i⟩ = A_i⟨g, A_a⟩ + C_ia for a < i, so that half of the derivatives are known.
    quotients: where the values are quotients, (N, D) of each. scope: None for values that are held
    only so that they are computed by themselves.
    """

    scope: Any
    letters: Sequence[Letter]
    values: list[Node]
    partials: list[tuple[Nodes, Slopes]] | None = None
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


class Walks:
    """The part of a `Graph` that goes through the nodes below others."""

    # what the graph itself has
    nodes: list[Node]
    one: Node
    _shown: dict[int, Expression]
    sum: Callable[[Iterable[tuple[Rational, Node]]], Node]
    product: Callable[[Iterable[tuple[Node, Rational]]], Node]
    make: Callable[[int, Any], Node]
    hold: Callable[[Node, Letter | None], Node]
    read: Callable[[Expression], Node]
    node: Callable[[Expression | Node], Node]
    result: Callable[[Any, int], Node]
    define: Callable[[Iterable[Letter], Iterable[Node]], None]
    shown: Callable[[Node], Expression]

    def __init__(self) -> None:
        self._opened: dict[Call, dict[int, Node]] = {}
        self._keys: dict[int, str] = {}

    def below(self, node: Node) -> list[Node]:
        """Return the nodes of which a node is computed."""
        kind, args, nodes = node.kind, node.args, self.nodes
        if kind == SUM:
            return [nodes[i] for i, _ in args[1]]
        if kind == PRODUCT:
            return [nodes[i] for i, _ in args]
        if kind == CALL:
            return [nodes[i] for i in args[1]]
        if kind == HELD:
            return [args[0].values[args[1]]]
        return list(args[0].arguments) if kind == RESULT else []

    def order(
        self, nodes: Iterable[Node], is_leaf: Callable[[Node], bool] = lambda e: False
    ) -> list[Node]:
        """Return the nodes and all below them, each after those of which it is computed.

        is_leaf: nodes below which nothing is looked at.
        """
        order: list[Node] = []
        seen = set[int]()
        pending = [(e, False) for e in reversed(list(nodes))]
        while pending:
            e, done = pending.pop()
            if done:
                order.append(e)
            elif e.index not in seen:
                seen.add(e.index)
                pending.append((e, True))
                if not is_leaf(e):
                    pending += [(a, False) for a in reversed(self.below(e)) if a.index not in seen]
        return order

    def rebuilt(self, nodes: Sequence[Node], swap: dict[int, Node]) -> list[Node]:
        """Return nodes with others in place of those of `swap`; nodes may be of another graph.

        Held values that change are not held any more if they become a number or a letter.
        """
        graph = nodes[0].graph if nodes else self
        made = dict(swap)
        calls: dict[Call, Call] = {}
        for e in graph.order(nodes, lambda e: e.index in swap):
            if e.index not in made:
                made[e.index] = self._rebuilt(e, made, calls)
        return [made[e.index] for e in nodes]

    def unheld(
        self, nodes: Sequence[Node], swap: dict[int, Node] | None = None,
        named: dict[Node, Node] | None = None,
    ) -> list[Node]:  # fmt: skip
        """Return nodes with others in place of those of `swap`, and no held nodes below them.

        named: what stands for a held value, where that is not the value itself.
        """
        made, named = dict(swap or {}), named or {}
        for e in self.order(nodes, lambda e: e.index in made):
            if e.kind == HELD and e.index not in made:
                value = made[self.below(e)[0].index]
                made[e.index] = named.get(value, value)
            elif e.index not in made:
                made[e.index] = self._rebuilt(e, made, {})
        return [made[e.index] for e in nodes]

    def _rebuilt(self, e: Node, made: dict[int, Node], calls: dict[Call, Call]) -> Node:
        kind, args = e.kind, e.args
        if kind == RESULT and e.graph is not self:
            return self.rebuilt([e.graph.opened(e)], made)[0]
        if kind == RESULT:
            letters = (e.graph.nodes[i] for i in made)
            swapped = {a.args for a in letters if a.kind == LETTER and made[a.index] is not a}
            if swapped & self.symbols([args[0].function.results[args[1]]]):
                return self.rebuilt([self.opened(e)], made)[0]
        if e.graph is self and all(made[a.index] is a for a in self.below(e)):
            return e
        if kind == SUM:
            terms = ((c, made[i]) for i, c in args[1])
            return self.sum([(args[0], self.one), *terms])
        if kind == PRODUCT:
            return self.product((made[i], n) for i, n in args)
        if kind == CALL:
            arguments = [made[i] for i in args[1]]
            if all(a.kind == NUMBER for a in arguments):
                swap = {slot(k): rational(a.args) for k, a in enumerate(arguments)}
                return self.read(args[0].xreplace(swap))
            return self.make(CALL, (args[0], tuple(a.index for a in arguments)))
        if kind == HELD:
            value, name = made[args[0].values[args[1]].index], e.graph._shown.get(e.index)
            own = None if name is None else sympy.Symbol(f"{name}_{len(self.nodes)}", real=True)
            return self.hold(value, own)
        if kind == RESULT:
            call, number = args
            if call not in calls:
                calls[call] = Call(call.function, [made[a.index] for a in call.arguments])
            node = self.result(calls[call], number)
            known = all(a.kind == NUMBER for a in calls[call].arguments)
            return self.opened(node) if known else node  # most of a function of numbers vanishes
        return self.make(kind, args)

    def depending(self, nodes: Sequence[Node], on: Collection[Node]) -> list[Node]:
        """Return those of the nodes that depend on some of others, or on results of calls."""
        dependents = set[Node]()
        for e in self.order(nodes):
            if e in on or e.kind == RESULT or any(a in dependents for a in self.below(e)):
                dependents.add(e)
        return [e for e in nodes if e in dependents]

    def opened(self, result: Node) -> Node:
        """Return a result of a call, written out in the arguments of the call."""
        call, number = result.args
        value = call.function.results[number]
        if call not in self._opened:
            own = (e.index for e in call.function.arguments)
            self._opened[call] = dict(zip(own, call.arguments, strict=True))
        made = self._opened[call]
        for e in self.order([value], lambda e: e.index in made):
            if e.index not in made:
                outside = e.kind == HELD and e.args[0].scope not in (None, call.function.scope)
                made[e.index] = e if outside else self._rebuilt(e, made, {})
        return made[value.index]

    def letters_below(self, expressions: Iterable[Expression | Node]) -> dict[Letter, Expression]:
        """Return the letters for held nodes and results on which expressions depend, with their
        values in sympy, in an order in which they can be computed."""
        values: dict[Letter, Expression] = {}
        nodes = [self.node(e) for e in expressions]
        for e in self._with_opened(nodes):
            if e.kind >= HELD and (letter := self._shown.get(e.index)) is not None:
                value = self.opened(e) if e.kind == RESULT else self.below(e)[0]
                values[letter] = self.shown(value)
        return values

    def symbols(
        self, expressions: Iterable[Expression | Node], apart: Collection[Node] = ()
    ) -> set[Letter]:
        """Return the letters that stand for nothing else, on which expressions depend.

        apart: nodes whose letters do not count.
        """
        nodes = self._with_opened([self.node(e) for e in expressions], apart)
        return {e.args for e in nodes if e.kind == LETTER}

    def _with_opened(self, nodes: Sequence[Node], apart: Collection[Node] = ()) -> list[Node]:
        """Return the nodes below, with what results of calls are if they are written out."""
        descendants: dict[Node, None] = {}
        for e in self.order(nodes, apart.__contains__):
            if e.kind == RESULT:
                descendants |= dict.fromkeys(self._with_opened([self.opened(e)], apart))
            descendants[e] = None
        return list(descendants)

    def written_out(
        self, expression: Expression | SymbolicMatrix, kept: Collection[Letter] = ()
    ) -> Expression | SymbolicMatrix:
        """Return an expression or a matrix of sympy with the letters of held nodes replaced.

        kept: letters that stay.
        """
        for letter, value in reversed(self.letters_below(_entries(expression)).items()):
            if letter not in kept:
                expression = expression.xreplace({letter: value})
        return expression

    def key(self, node: Node) -> str:
        """Return a digest of a node that does not depend on the order in which nodes were made."""
        known = self._keys
        if node.index not in known:
            for e in self.order([node], lambda e: e.index in known):
                if e.index not in known:
                    known[e.index] = blake2b(self._text(e).encode(), digest_size=12).hexdigest()
        return known[node.index]

    def _text(self, e: Node) -> str:
        kind, args, keys = e.kind, e.args, self._keys
        if kind == SUM:
            return f"{args[0]} + {sorted((keys[i], str(c)) for i, c in args[1])}"
        if kind == PRODUCT:
            return f"{sorted((keys[i], str(n)) for i, n in args)}"
        if kind == CALL:
            return f"{_written(args[0])} {[keys[i] for i in args[1]]}"
        if kind == HELD:
            return f"held {keys[self.below(e)[0].index]}"
        if kind == RESULT:
            call, number = args
            function = call.function
            if function is None:
                return f"{number} of {[keys[a.index] for a in call.arguments]}"
            own = [*map(self.key, function.arguments)], self.key(function.results[number])
            return f"{own} at {[keys[a.index] for a in call.arguments]}"
        return f"{kind} {_written(args) if kind == CONSTANT else args}"


def _entries(expression: Expression | SymbolicMatrix) -> list[Expression]:
    return list(expression) if hasattr(expression, "__len__") else [expression]


@lru_cache(maxsize=4096)
def _written(e: Expression) -> str:
    return re.sub(r", dummy_index=\d+", "", sympy.srepr(e))
