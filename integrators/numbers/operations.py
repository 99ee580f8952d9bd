"""The operations that compute nodes of a graph: values up to their signs, each computed once.

Equal operations on equal values are one operation, so common subexpressions need no search. Only
partial sums and products that occur in several sums and products are looked for (`share`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from typing import Any

from .arithmetic import FUNCTIONS, refused
from .exact import refuse_long
from .graph import Graph
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
    Node,
    Rational,
    Walks,
    ratio,
    slot,
)
from .registered import is_table, tabulated
from .types import Expression, Letter, Letters

#: kinds of operations; their `details`: the text of a LEAF, the expression or the name of a
#: FUNCTION, the name of one with several results that is CALLED, the object that writes LINES, the
#: number of a result as an ENTRY
LEAF, ADD, MULTIPLY, INVERT, POWER, FUNCTION, CALLED, LINES, ENTRY = range(9)
#: rough durations of operations in additions; those of all other kinds take LONG
DURATIONS, LONG = {LEAF: 0, ADD: 1, MULTIPLY: 1, LINES: 0, ENTRY: 0}, 4
MOST = 16  # the largest power that is a product; larger ones by the library's power
_CONSTANTS = {"pi": "PI", "E": "exp(R(1))", "I": "1j"}

#: a value: twice the number of its operation, plus one for the opposite
Value = int
#: (caller, function, numbers of the results) ↦ (name of the function that has these results, names
#: that it uses beside its arguments, with their nodes: None for a coefficient)
Written = Callable[["Operations", Any, Sequence[int]], "tuple[str, dict[str, Node | None]]"]


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

    def look_at(self, graph: Walks, nodes: Sequence[Node]) -> None:
        """Find out which of these nodes, and of those below, are constant."""
        known = self._constant
        for e in graph.order(nodes, known.__contains__):
            if e not in known:
                free = e.kind == RESULT or (e.kind == LETTER and e.args not in self._parameters)
                known[e] = not (free or self.plain) and all(map(known.get, graph.below(e)))

    def constant(self, e: Node) -> bool:
        """Return True if all letters in a node are of q."""
        answer = self._constant.get(e)
        if answer is None:
            self.look_at(e.graph, [e])
            answer = self._constant[e]
        return answer

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
        return self.place(self.graph.read(letter))[0]


class Operations:
    """The operations of one function: `kinds`, `parts` (values) and `details` by number.

    coefficients: values that are computed once a flow and have names. written: writes functions
    that are called. inside: the scope of such a function; nodes that other scopes hold are letters
    of its caller's.
    """

    def __init__(
        self,
        graph: Graph,
        coefficients: Coefficients | None = None,
        written: Written | None = None,
        inside: object = None,
    ) -> None:
        self.graph, self.coefficients = graph, coefficients
        self.written, self.inside = written, inside
        self.kinds: list[int] = []
        self.parts: list[list[Value]] = []
        self.details: list[Any] = []
        #: how long the result of each operation takes at least, in additions
        self.depths: list[int] = []
        #: the nodes of letters, by name; None for a coefficient
        self.letters: dict[str, Node | None] = {}
        #: {index of a letter u: (the letter of h, the value hu)}: u is written as hu/h
        self.scaled: dict[int, tuple[Node, Value]] = {}
        self._numbers: dict[Hashable, int] = {}
        self._known: dict[int, Value] = {}
        self._tables: dict[Expression, Expression] = {}
        self._places: dict[Hashable, list[int]] = {}
        self._unknown: list[Expression] = []

    def give(self, nodes: Iterable[Node], values: Iterable[Value]) -> None:
        """Let values stand for nodes: nothing below these is computed."""
        self._known |= zip((e.index for e in nodes), values, strict=True)

    def name(self, node: Node, name: str) -> Value:
        """Let a name stand for a node; return its value."""
        value = self._known[node.index] = self.leaf(name, node)
        return value

    def scale(self, u: Node, h: Node) -> None:
        """Write a letter u as hu/h."""
        self._known.pop(u.index, None)
        self.scaled[u.index] = h, self.product([self._value(h), self.leaf(str(u.args))])

    def values(self, nodes: Sequence[Node]) -> list[Value]:
        """Return the values of nodes, with all their parts.

        All results of functions that are called have to be below the nodes of one call. Raises
        `BadInput` for a function that no arithmetic has.
        """
        if self.coefficients is not None:
            self.coefficients.look_at(self.graph, nodes)
        order = self.graph.order(nodes, self._is_leaf)
        functions = [e.args[0] if e.kind == CALL else e.args
                     for e in order if e.kind in (CALL, CONSTANT)]  # fmt: skip
        if functions:
            self._tables |= tabulated(functions)
        for e in order:
            if e.kind == RESULT and e.index not in self._known:
                call, number = e.args
                self._places.setdefault(call.function, []).append(number)
        for key, places in self._places.items():
            self._places[key] = sorted(set(places))
        for e in order:
            if not self._is_constant(e):  # these are asked for, if they are used by themselves
                self._value(e)
        if self._unknown:  # the shortest is the user's own, others are its derivatives
            raise refused(min(self._unknown, key=lambda e: len(str(e))))
        return list(map(self._value, nodes))

    def _is_leaf(self, e: Node) -> bool:
        return e.index in self._known or self._is_constant(e) or self._is_outside(e)

    def _is_constant(self, e: Node) -> bool:
        return self.coefficients is not None and self.coefficients.constant(e)

    def _is_outside(self, e: Node) -> bool:
        return e.kind == HELD and e.args[0].scope not in (None, self.inside) and bool(self.inside)

    def _value(self, e: Node) -> Value:
        value = self._known.get(e.index)
        if value is None:
            value = self._known[e.index] = self._added(e)
        return value

    def _added(self, e: Node) -> Value:
        kind, args, nodes = e.kind, e.args, self.graph.nodes
        if kind == NUMBER and args.denominator == 1:
            return self._rational(args)
        if self._is_constant(e):
            assert self.coefficients is not None
            place, minus = self.coefficients.place(e)
            return self.leaf(f"c{place}", None) + minus
        if kind == NUMBER:
            return self._rational(args)
        if kind == LETTER and e.index not in self.scaled:
            return self.leaf(str(args), e)
        if kind == LETTER:
            return self._product([(e, 1)])
        if kind == CONSTANT:
            return self._of_sympy(self._tables.get(args, args), {}, e)
        if kind == SUM:
            return self._terms(*args)
        if kind == PRODUCT:
            return self._product([(nodes[i], n) for i, n in args])
        if kind == CALL:
            function, arguments = args
            values = {slot(k): self._value(nodes[i]) for k, i in enumerate(arguments)}
            return self._of_sympy(self._tables.get(function, function), values, e)
        if kind == HELD:
            group, place = args
            if self._is_outside(e):
                return self.leaf(str(group.letters[place]), e)
            return self._value(group.values[place])
        return self._result(e)

    def _result(self, e: Node) -> Value:
        """Return a result of a call, or of lines that compute several results."""
        call, number = e.args
        if call.function is not None and self.written is None:
            return self.values([self.graph.opened(e)])[0]
        arguments = self.values(call.arguments)
        if call.function is None:
            made = self._operation(LINES, arguments, call)
        else:
            assert self.written is not None
            places = self._places[call.function]
            name, more = self.written(self, call.function, places)
            arguments += [self.leaf(s, None) if e is None else self._value(e)
                          for s, e in more.items()]  # fmt: skip
            made, number = self._operation(CALLED, arguments, name), places.index(number)
        return self._operation(ENTRY, [made], number)

    def leaf(self, name: str, node: Node | None = None) -> Value:
        """Return the value that has a name; None: of no node."""
        self.letters[name] = node
        return self._operation(LEAF, (), name)

    def _operation(
        self, kind: int, parts: Iterable[Value], detail: Hashable, key: Hashable = None
    ) -> Value:
        parts = list(parts)
        by = kind, key or detail, *(sorted(parts) if kind in (ADD, MULTIPLY) else parts)
        if by not in self._numbers:
            self._numbers[by] = len(self.kinds)
            self.kinds.append(kind)
            self.parts.append(parts)
            self.details.append(detail)
            longest = max([self.depths[p >> 1] for p in parts], default=0)
            self.depths.append(longest + DURATIONS.get(kind, LONG))
        return 2 * self._numbers[by]

    def _rational(self, value: Rational) -> Value:
        p, q = abs(value.numerator), value.denominator
        refuse_long((p, q), "what a step computes")
        text = str(p) if q == 1 else f"(R({p})/{q})"
        return self._operation(LEAF, (), text) + int(value < 0)

    def _terms(self, constant: Rational, terms: Sequence[tuple[int, Rational]]) -> Value:
        """Return the value of a sum, whose coefficients are added up."""
        graph = self.graph
        rest, fixed = list[tuple[Rational, Node]](), list[tuple[Rational, Node]]()
        for i, c in sorted(terms, key=lambda term: graph.key(graph.nodes[term[0]])):
            (fixed if self._is_constant(graph.nodes[i]) else rest).append((c, graph.nodes[i]))
        parts = [self._value(graph.sum([(constant, graph.one), *fixed]))] if fixed else (
            [self._value(graph.number(constant))] if constant else [])  # fmt: skip
        for c, e in rest:
            factors = [(graph.nodes[i], n) for i, n in e.args] if e.kind == PRODUCT else [(e, 1)]
            parts.append(self._value(e) ^ (c < 0) if abs(c) == 1 else self._product(factors, c))
        return self.sum(parts)

    def _product(self, factors: Iterable[tuple[Node, Rational]], c: Rational = 1) -> Value:
        """Return the value of a product, whose coefficients are multiplied."""
        fixed, parts = [], []
        for e, n in sorted(factors, key=lambda factor: self.graph.key(factor[0])):
            if self._is_constant(e):
                fixed.append((e, n))
            elif e.index in self.scaled and n.denominator == 1:
                h, value = self.scaled[e.index]
                fixed.append((h, -n))
                parts.append(self._power(value, n))
            else:
                parts.append(self._factor(e, n))
        if not fixed and c == 1:
            return self.product(parts)
        return self.product([self._value(self.graph.product(fixed, c)), *parts])

    def _factor(self, e: Node, n: Rational) -> Value:
        if n == 1:
            return self._value(e)
        power = self.graph.product([(e, n)])
        if power.index not in self._known:
            self._known[power.index] = self._power(self._value(e), n)
        return self._known[power.index]

    def _power(self, base: Value, exponent: Rational) -> Value:
        whole, rest = divmod(abs(exponent), 1)
        if whole > MOST or rest not in (0, 0.5):
            size = self._operation(POWER, (base, self._value(self.graph.number(abs(exponent)))), "")
        else:
            root = [self._operation(FUNCTION, [base], "sqrt")] if rest else []
            size = self.product([*[base] * int(whole), *root])
        return size if exponent > 0 else self.inverse(size)

    def inverse(self, e: Value) -> Value:
        """Return 1/e."""
        return self._operation(INVERT, [e & ~1], "") + e % 2

    def sum(self, terms: Iterable[Value]) -> Value:
        """Return the value of a sum; a − b and b − a are one: the first term is positive."""
        terms = list(terms)
        if len(terms) == 1:
            return terms[0]
        minus = min(terms) % 2
        return self._operation(ADD, (t ^ minus for t in terms), "") + minus

    def product(self, factors: Sequence[Value]) -> Value:
        """Return the value of a product; equal factors become powers."""
        minus = sum(f % 2 for f in factors) % 2
        counts = Counter(f & ~1 for f in factors if self.details[f >> 1] != "1")
        if len(counts) > 1:
            parts = [f if n == 1 else self._operation(MULTIPLY, [f] * n, "")
                     for f, n in counts.items()]  # fmt: skip
        else:
            parts = list(counts.elements()) or [factors[0] & ~1]
        return (self._operation(MULTIPLY, parts, "") if len(parts) > 1 else parts[0]) + minus

    def function(self, name: str, e: Value) -> Value:
        """Return a function of one value, by the name that the text has for it."""
        return self._operation(FUNCTION, [e], name)

    def _of_sympy(self, e: Expression, slots: dict[Expression, Value], whole: Node) -> Value:
        """Return the value of a function of slots, or of an expression without letters."""
        if e in slots:
            return slots[e]
        if slots and not e.free_symbols:
            return self._value(self.graph.read(e))
        if e.is_Rational:
            return self._rational(ratio(e.p, e.q))
        if e.is_Float:
            return self._operation(LEAF, (), f"R('{_decimal(abs(e))}')") + bool(e < 0)
        if e.is_NumberSymbol or e is sympy.I:
            return self._operation(LEAF, (), _CONSTANTS.get(str(e), f"constant('{e}')"))
        known = hasattr(e, "written") or type(e).__name__ in FUNCTIONS or is_table(e)
        arithmetic = e.is_Add or e.is_Mul or e.is_Pow
        if not (known or arithmetic) or not all(isinstance(a, sympy.Expr) for a in e.args):
            self._unknown.append(self.graph.shown(whole))  # such as a condition
            return self._operation(LEAF, (), str(e))
        if e.is_Pow and e.exp.is_Rational:
            return self._power(self._of_sympy(e.base, slots, whole), ratio(e.exp.p, e.exp.q))
        parts = [self._of_sympy(a, slots, whole) for a in e.args]
        if e.is_Pow:
            return self._operation(POWER, parts, "")
        if arithmetic:
            return self.sum(parts) if e.is_Add else self.product(parts)
        return self._operation(FUNCTION, parts, e, e.func)

    def share(self, roots: Iterable[Value]) -> None:
        """Give partial sums and products that occur in several an operation of their own."""
        live = self.uses(roots)
        for kind, made in (ADD, self.sum), (MULTIPLY, self.product):
            candidates = sorted((i for i in live if self.kinds[i] == kind),
                                key=lambda i: (len(self.parts[i]), i))  # fmt: skip
            groups = {i: set(self.parts[i]) for i in candidates
                      if len(set(self.parts[i])) == len(self.parts[i])}  # fmt: skip
            for i, rest in _shared(groups, made):
                kept = [p for p in self.parts[i] if p in rest]
                self.parts[i] = [*sorted(rest.difference(kept)), *kept]

    def uses(self, roots: Iterable[Value]) -> Counter[int]:
        """Return how often each operation is used by the roots and by those that they need."""
        counts = Counter(r >> 1 for r in roots)
        pending = list(counts)
        while pending:
            parts = [p >> 1 for p in self.parts[pending.pop()]]
            pending += dict.fromkeys(p for p in parts if p not in counts)
            counts.update(parts)
        return counts


def _decimal(number: Expression) -> str:
    """Return all decimals of a Float's binary value; `str` would give only fifteen of 0.1."""
    from mpmath.libmp import to_str

    _, _, exponent, bits = number._mpf_
    return str(to_str(number._mpf_, bits + 3 * abs(exponent)))  # each bit is a decimal at most


def _shared(
    groups: dict[int, set[Value]], made: Callable[[list[Value]], Value]
) -> list[tuple[int, set[Value]]]:
    """Return [(node, its parts)] of the sums, or the products, whose parts change.

    groups: the parts of each, the shortest first. Each is compared with the longer ones, and the
    smallest common part becomes a node first. made: a function that adds a node for common parts.
    """
    owners: dict[Value, dict[int, None]] = {}
    for i, group in groups.items():
        for part in group:
            owners.setdefault(part, {})[i] = None
    changed: dict[int, None] = {}

    def replaced(i: int, common: set[Value], by: Value) -> None:
        for part in common:
            owners[part].pop(i, None)
        groups[i] = {*(groups[i] - common), by}
        owners.setdefault(by, {})[i] = None
        changed[i] = None

    for i in groups:
        for part in groups[i]:
            del owners[part][i]  # only later groups stay
        met = Counter(j for part in sorted(groups[i]) for j in owners[part])
        others = sorted((n, j) for j, n in met.items() if n > 1)
        for _, j in others:
            common = groups[i] & groups[j]
            if len(common) < 2:
                continue
            if common == groups[i]:
                by = 2 * i
            else:
                by = 2 * j if common == groups[j] else made(sorted(common))
                if by in groups[i]:  # a sum in a sum: as one of a set it would count once
                    continue
                groups[i] = {*(groups[i] - common), by}
                changed[i] = None
            for _, k in others:
                if k != by >> 1 and common <= groups[k] and by not in groups[k]:
                    replaced(k, common, by)
    return [(i, groups[i]) for i in changed]
