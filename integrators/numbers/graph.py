"""Expressions as one graph that differentiates itself.

A `Graph` holds every expression once: equal ones are the same node. Sums collect like terms and
products collect powers, with rational coefficients, as sympy's do; so a partial derivative that two
letters share is found again, and second derivatives of a sum of potentials are those of its terms.
`Graph.read` makes nodes of sympy's expressions, `Graph.shown` expressions of nodes.
Nodes may stand for others (`held`), through which derivatives go.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from math import gcd
from typing import Any

from .lazy import sympy
from .nodes import (
    CALL,
    CONSTANT,
    HELD,
    LETTER,
    NUMBER,
    PRODUCT,
    RESULT,
    SUM,
    Group,
    Node,
    NodeMatrix,
    Rational,
    Row,
    Walks,
    ratio,
    rational,
    reduced,
    slot,
)
from .types import Column, Entries, Expression, Letter, Replacement, SymbolicMatrix


class Graph(Walks):
    """All nodes of expressions that are differentiated together; each exists once."""

    def __init__(self) -> None:
        super().__init__()
        self.nodes: list[Node] = []
        self.parts = 0  # number of groups and calls of all scopes
        self._known: dict[Hashable, Node] = {}
        self._read: dict[Expression, Node] = {}
        self._shown: dict[int, Expression] = {}
        self._slopes: dict[int, Row] = {}
        self._primitives: dict[int, tuple[Rational, Node]] = {}
        self._holds: dict[int, Node] = {}
        #: indices of letters by which nothing is differentiated: the step, the parameters
        self.fixed: set[int] = set()
        self.one = self.number(1)

    def make(self, kind: int, args: Any) -> Node:
        """Return the node of this kind with these arguments, which must be in normal form."""
        key = kind, args
        node = self._known.get(key)
        if node is None:
            node = self._known[key] = Node(self, kind, args, len(self.nodes))
            self.nodes.append(node)
        return node

    def number(self, value: Rational) -> Node:
        """Return the node of a rational number."""
        return self.make(NUMBER, value)

    def letters(self, symbols: Iterable[Letter]) -> list[Node]:
        """Return the nodes of letters, or the held nodes that they stand for."""
        return [self.read(s) for s in symbols]

    def define(self, letters: Iterable[Letter], nodes: Iterable[Node]) -> None:
        """Let letters of sympy be read as nodes."""
        self._read |= zip(letters, nodes, strict=True)

    def name(self, letters: Sequence[Letter], nodes: Sequence[Node]) -> None:
        """Let letters of sympy be read as nodes, which are shown as the letters."""
        self.define(letters, nodes)
        self._shown |= zip((e.index for e in nodes), letters, strict=True)

    def value_of(self, letter: Letter) -> Expression | None:
        """Return the value of a letter in sympy, or None if it stands for no held node."""
        node = self._read.get(letter)
        if node is None or node.kind != HELD:
            return None
        group, place = node.args
        return self.shown(group.values[place])

    def node(self, value: Expression | Node) -> Node:
        """Return a node as it is, a rational number or an expression of sympy as a node."""
        if isinstance(value, Node):
            return value
        if isinstance(value, int):
            return self.number(value)
        return self.read(sympy.sympify(value))

    def sum(self, terms: Iterable[tuple[Rational, Node]]) -> Node:
        """Return Σ coefficient · node, with like terms collected."""
        constant: Rational = 0
        coefficients: dict[int, Rational] = {}
        for c, e in terms:
            if e.kind == NUMBER:
                constant += c * e.args
            elif e.kind == SUM:
                constant += c * e.args[0]
                for i, a in e.args[1]:
                    coefficients[i] = coefficients.get(i, 0) + c * a
            else:
                coefficients[e.index] = coefficients.get(e.index, 0) + c
        items = tuple(sorted((i, reduced(c)) for i, c in coefficients.items() if c))
        if not items:
            return self.number(reduced(constant))
        if len(items) == 1 and not constant and items[0][1] == 1:
            return self.nodes[items[0][0]]
        return self.make(SUM, (reduced(constant), items))

    def product(self, factors: Iterable[tuple[Node, Rational]], coefficient: Rational = 1) -> Node:
        """Return coefficient · Π node^exponent, with powers collected."""
        powers: dict[int, Rational] = {}
        pending = list(factors)
        while pending:
            e, n = pending.pop()
            kind, whole = e.kind, n.denominator == 1
            if not n:
                continue
            if kind == NUMBER and whole and (e.args or n > 0):
                coefficient *= ratio(e.args) ** int(n) if n < 0 else e.args ** int(n)
            elif kind == PRODUCT and whole:
                pending += [(self.nodes[i], p * n) for i, p in e.args]
            elif kind == SUM and whole:
                if e.index not in self._primitives:
                    self._primitives[e.index] = self._primitive(e)
                size, base = self._primitives[e.index]
                if size != 1:
                    coefficient *= ratio(size) ** int(n) if n < 0 else size ** int(n)
                    pending.append((base, n))
                else:
                    powers[e.index] = powers.get(e.index, 0) + n
            else:
                powers[e.index] = powers.get(e.index, 0) + n
            if not pending:  # roots that became whole powers of products
                for i, p in list(powers.items()):
                    if p and p.denominator == 1 and self.nodes[i].kind == PRODUCT:
                        pending.append((self.nodes[i], powers.pop(i)))
        if not coefficient:
            return self.number(0)
        coefficient = reduced(coefficient)
        items = tuple(sorted((i, n) for i, n in powers.items() if n))
        if not items:
            return self.number(coefficient)
        if len(items) == 1 and items[0][1] == 1:
            node = self.nodes[items[0][0]]
            return node if coefficient == 1 else self.sum([(coefficient, node)])
        node = self.make(PRODUCT, items)
        return node if coefficient == 1 else self.make(SUM, (0, ((node.index, coefficient),)))

    def _primitive(self, e: Node) -> tuple[Rational, Node]:
        """Return (c, e) of a sum c·e that is a factor: c is its sign times the whole number that
        divides all of its terms, or the coefficient of a single term."""
        constant, terms = e.args
        if not constant and len(terms) == 1:
            return terms[0][1], self.nodes[terms[0][0]]
        sign = 1 if terms[0][1] > 0 else -1
        size = 0
        for number in (*(c for _, c in terms), constant):
            if number.denominator != 1:
                size = 1
                break
            size = gcd(size, int(number))
        size *= sign
        if size == 1:
            return 1, e
        scale = ratio(1, size) if abs(size) != 1 else size
        return size, self.sum([(scale, e)])

    def divided(self, node: Node, by: Node) -> Node:
        """Return node/by, a sum term by term, so that powers of `by` cancel."""
        over = self.product([(by, -1)])
        return self.sum((c, e * over) for c, e in node.terms)

    def expanded(self, node: Node) -> Node:
        """Return the node with products of sums multiplied out, to whole positive powers."""
        if node.kind == SUM:
            return self.sum((c, self.expanded(e)) for c, e in node.terms)
        if node.kind != PRODUCT:
            return node
        summands, rest = [(1, self.one)], []
        for i, n in node.args:
            base = self.nodes[i]
            if base.kind != SUM or n < 0 or n.denominator != 1:
                rest.append((base, n))
                continue
            parts = self.expanded(base).terms
            for _ in range(int(n)):
                summands = [(a * c, e * part) for a, e in summands for c, part in parts]
        outside = self.product(rest)
        return self.sum((c, e * outside) for c, e in summands)

    def collected(self, node: Node, by: Sequence[Node]) -> Node:
        """Return the node multiplied out and then written as Σ e · (…) for the nodes e of `by`:
        every term is with the first of them that it has as a factor."""
        shares: dict[Node, list[tuple[Rational, Node]]] = {e: [] for e in (*by, self.one)}
        for c, term in self.expanded(node).terms:
            powers = dict(term.args) if term.kind == PRODUCT else {term.index: 1}
            first = next((e for e in by if powers.get(e.index, 0) >= 1), self.one)
            shares[first].append((c, self.product([(term, 1), (first, -1)])))
        return self.sum((1, e * self.sum(rest)) for e, rest in shares.items())

    def combined(self, pairs: Sequence[tuple[Rational, Node | None, Row]]) -> Row:
        """Return Σ coefficient · factor · row, without zeros; a factor None is 1."""
        if len(pairs) == 1 and pairs[0][1] is None and pairs[0][0] == 1:
            return pairs[0][2]
        terms: dict[int, list[tuple[Rational, Node]]] = {}
        for c, factor, row in pairs:
            for j, e in row.items():
                size = c
                if factor is not None and e.kind == NUMBER:
                    size, e = c * e.args, factor
                elif factor is not None:
                    e = self.product([(factor, 1), (e, 1)])
                terms.setdefault(j, []).append((size, e))
        sums = ((j, self.sum(t)) for j, t in terms.items())
        return {j: e for j, e in sums if e}

    def result(self, call: Any, number: int) -> Node:
        """Return a result of a call; call.partials(number) is [(nodes, function of the slopes)]."""
        return self.make(RESULT, (call, number))

    def hold(self, value: Node, letter: Letter | None = None) -> Node:
        """Return a node that is computed by itself: sums and products do not take it apart.

        letter: the one as which it is shown; without one its value is shown.
        """
        if value.kind not in (SUM, PRODUCT, CALL):
            return value
        if value.index not in self._holds:
            made = self.make(HELD, (Group(None, (), [value], named=False), 0))
            self._holds[value.index] = made
            if letter is not None:
                self.name([letter], [made])
        return self._holds[value.index]

    def matrix(self, matrix: SymbolicMatrix) -> NodeMatrix:
        """Return the nodes of a matrix of sympy, row by row."""
        return [[self.read(e) for e in row] for row in matrix.tolist()]

    def column(self, entries: Entries) -> list[Node]:
        """Return the nodes of expressions of sympy and of numbers; nodes stay as they are."""
        return [self.node(e) for e in entries]

    def transposed(self, matrix: NodeMatrix, other: Sequence[Node], width: int = 0) -> list[Node]:
        """Return matrixᵀ · column. width: the number of columns of a matrix without rows."""
        width = len(matrix[0]) if matrix else width
        return [
            self.sum(
                (1, self.product([(row[j], 1), (e, 1)]))
                for row, e in zip(matrix, other, strict=True)
                if row[j] and e
            )
            for j in range(width)
        ]

    def times(self, matrix: NodeMatrix, column: Sequence[Node]) -> list[Node]:
        """Return matrix · column."""
        return [
            self.sum((1, a * e) for a, e in zip(row, column, strict=True) if a and e)
            for row in matrix
        ]

    def plus(self, *columns: Sequence[Node]) -> list[Node]:
        """Return the sum of columns."""
        return [self.sum((1, e) for e in row) for row in zip(*columns, strict=True)]

    def minus(self, column: Sequence[Node], *others: Sequence[Node]) -> list[Node]:
        """Return a column less others."""
        rows = zip(column, *others, strict=True)
        return [self.sum([(1, e), *((-1, a) for a in less)]) for e, *less in rows]

    def read(self, e: Expression, swap: dict[Expression, Node] | None = None) -> Node:
        """Return the node of an expression of sympy. swap: nodes for parts of it; all other parts
        that are read are added to it."""
        known = self._read if swap is None else swap
        node = known.get(e)
        if node is None:
            node = known[e] = self._added(e, swap)
        return node

    def _added(self, e: Expression, swap: dict[Expression, Node] | None) -> Node:
        if e.is_Rational:
            return self.number(int(e.p) if e.q == 1 else ratio(e.p, e.q))
        if e.is_Symbol:
            return self._read[e] if e in self._read else self.make(LETTER, e)
        if e.is_Add or e.is_Mul:
            parts = []
            for a in e.args:  # no generator, which would make the way down twice as long
                parts.append(self.read(a, swap))
            return (
                self.sum((1, a) for a in parts) if e.is_Add else self.product((a, 1) for a in parts)
            )
        if e.is_Pow and e.exp.is_Rational:
            exponent = ratio(e.exp.p, e.exp.q)
            base = self.read(e.base, swap)
            if base.kind != NUMBER or (exponent.denominator == 1 and base.args):
                return self.product([(base, exponent)])
        if not e.args or not any(a.free_symbols for a in e.args):
            return self.make(CONSTANT, e)
        function, arguments = _with_slots(e)
        return self.make(CALL, (function, tuple(self.read(a, swap).index for a in arguments)))

    def slopes(self, node: Node) -> Row:
        """Return {index: derivative} by the letters and the held nodes that a node contains, as if
        they were independent of each other; not by those of `fixed`."""
        row = self._slopes.get(node.index)
        if row is None:
            row = self._slopes[node.index] = self._derived(node)
        return row

    def _derived(self, node: Node) -> Row:
        kind, args = node.kind, node.args
        if kind in (LETTER, HELD, RESULT):
            return {} if node.index in self.fixed else {node.index: self.one}
        pairs: list[tuple[Rational, Node | None, Row]] = []  # coefficient, factor, row
        if kind == SUM:
            for i, c in args[1]:
                pairs.append((c, None, self.slopes(self.nodes[i])))
        elif kind == PRODUCT:
            for place, (i, n) in enumerate(args):
                if row := self.slopes(self.nodes[i]):
                    rest = [(self.nodes[k], p) for at, (k, p) in enumerate(args) if at != place]
                    pairs.append((n, self.product([*rest, (self.nodes[i], n - 1)]), row))
        elif kind == CALL:
            for place, i in enumerate(args[1]):
                if row := self.slopes(self.nodes[i]):
                    pairs.append((1, self.slope(node, place), row))
        return self.combined(pairs)

    def varies(self, node: Node) -> bool:
        """True if a node has letters below it, other than those of `fixed`."""
        return any(e.is_letter and e.index not in self.fixed for e in self.order([node]))

    def slope(self, call: Node, place: int) -> Node:
        """Return the derivative of a function by one of its arguments."""
        function, arguments = call.args
        value = function.diff(slot(place))
        if value.has(sympy.Derivative):  # no derivative is known; its evaluation raises an error
            bound = sympy.Dummy("bound", real=True)
            value = sympy.Subs(value.xreplace({slot(place): bound}), bound, slot(place))
            return self.make(CALL, (value, arguments))
        return self.read(value, {slot(k): self.nodes[i] for k, i in enumerate(arguments)})

    def shown(self, node: Node) -> Expression:
        """Return the node in sympy, with letters for held nodes."""
        expression = self._shown.get(node.index)
        if expression is None:
            expression = self._shown[node.index] = self._written(node)
            self._read.setdefault(expression, node)
        return expression

    def _written(self, node: Node) -> Expression:
        kind, args = node.kind, node.args
        if kind == NUMBER:
            return rational(args)
        if kind in (LETTER, CONSTANT):
            return args
        parts = []
        if kind == SUM:
            for i, c in args[1]:
                part = self.shown(self.nodes[i])
                parts.append(part if c == 1 else sympy.Mul(rational(c), part))
            return sympy.Add(rational(args[0]), *parts) if args[0] else sympy.Add(*parts)
        if kind == PRODUCT:
            for i, n in args:
                base = self.shown(self.nodes[i])
                parts.append(base if n == 1 else base ** rational(n))
            return sympy.Mul(*parts)
        if kind == HELD:  # it has no letter
            return self.shown(args[0].values[args[1]])
        assert kind == CALL, "results have letters"
        function, arguments = args
        swap = {slot(k): self.shown(self.nodes[i]) for k, i in enumerate(arguments)}
        return function.xreplace(swap)

    def shown_column(self, nodes: Sequence[Node]) -> Column:
        """Return nodes as a column of sympy."""
        return sympy.Matrix(len(nodes), 1, [self.shown(e) for e in nodes])


def _with_slots(e: Expression) -> tuple[Expression, list[Expression]]:
    """Return a function with slots for the arguments that contain letters, and these arguments.

    An entry of a table is a function of the arguments of the table; an expression that is not a
    function is treated as a function of its letters.
    """
    if not isinstance(e, sympy.Function | sympy.Pow):
        letters = sorted(e.free_symbols, key=str)
        return e.xreplace({s: slot(k) for k, s in enumerate(letters)}), letters
    arguments: list[Expression] = []

    def slotted(part: Expression) -> Expression:
        arguments.append(part)
        return slot(len(arguments) - 1)

    def function(of: Expression) -> Expression:
        parts = []
        for a in of.args:
            if not a.free_symbols:
                parts.append(a)
            elif hasattr(a, "slope") or not isinstance(a, sympy.Expr):
                parts.append(function(a))
            else:
                parts.append(slotted(a))
        return of.func(*parts)

    return function(e), arguments


# Trees of sympy in which equal parts are one: each is visited once.


def parts_of(expressions: Iterable[Expression]) -> set[Expression]:
    """Return all subexpressions, each visited once: sympy's `atoms` visits shared ones again."""
    seen, pending = set[Expression](), list(expressions)
    while pending:
        e = pending.pop()
        if e not in seen:
            seen.add(e)
            pending += e.args
    return seen


def symbols_of(expressions: Iterable[Expression]) -> set[Letter]:
    """Return all symbols of the expressions."""
    return {e for e in parts_of(expressions) if e.is_Symbol}


def replaced(
    expressions: Iterable[Expression], swap: Replacement, known: Replacement | None = None
) -> list[Expression]:
    """Return the expressions with letters replaced; shared parts are rebuilt once.

    known: the parts that the same `swap` has rebuilt so far; it grows.
    """
    known = {} if known is None else known
    known.update(swap)

    def rebuilt(e: Expression) -> Expression:
        if e not in known:
            args = [rebuilt(a) for a in e.args]
            same = all(a is b for a, b in zip(args, e.args, strict=True))
            known[e] = e if same else e.func(*args)
        return known[e]

    return [rebuilt(e) for e in expressions]
