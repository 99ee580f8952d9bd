"""Exact numbers as decimals: sympy expressions without symbols, each subexpression once.

sympy's own evalf visits a shared subexpression as often as it occurs, and raises its precision
without end for a zero. `numeric` would do as well, but to print and compile what is evaluated once
takes ten times as long (outer solar system: 0.56 s for 0.05 s). Functions of ours take part by a
method `in_arithmetic(numbers, values)`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import reduce
from operator import add, mul
from typing import Any

from .arithmetic import FUNCTIONS, Arithmetic, arithmetic, refused
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
    Node,
    NodeMatrix,
    Rational,
    slot,
)
from .types import Exact, Expression, Letter, Mpf, Number, SymbolicMatrix


def evaluate(expression: Expression, digits: int) -> Number:
    """Return the value of an expression without symbols: a gmpy2 number, complex if the value is.

    It has that many digits (more than 16) and guard digits.
    """
    return evaluate_at([expression], {}, digits)[0]


def evaluate_at(
    expressions: Iterable[Expression],
    point: Mapping[Letter, Exact],
    digits: int,
    graph: Graph | None = None,
) -> list[Number]:
    """Return the values of expressions at a point: exact numbers by symbols.

    graph: its letters for held nodes need no number of their own.
    """
    if graph is not None:
        return node_values(graph.column(expressions), point, digits)
    numbers = arithmetic(digits)
    with numbers.working():
        letters = {symbol: numbers.number(value) for symbol, value in point.items()}
        return _values(expressions, letters, numbers)


def node_values(nodes: Sequence[Node], point: Mapping[Letter, Exact], digits: int) -> list[Number]:
    """Return the values of nodes of one graph at a point: exact numbers by letters."""
    numbers = arithmetic(digits)
    with numbers.working():
        letters = {letter: numbers.number(value) for letter, value in point.items()}
        return _of_nodes(nodes, letters, {}, numbers)


def _of_nodes(
    nodes: Sequence[Node],
    letters: Mapping[Letter, Number],
    known: dict[Any, Any],
    numbers: Arithmetic,
) -> list[Number]:
    """Return the values of nodes; known: values by the indices of nodes, to which others come.

    By the arguments of functions, and by calls, it has what is known inside these: a table of
    several numbers is computed once, however many of them are asked for.
    """
    if not nodes:
        return []
    graph = nodes[0].graph
    for e in graph.order(nodes, lambda e: e.index in known):
        if e.index in known:
            continue
        kind, args = e.kind, e.args
        if kind == NUMBER:
            value = _number(args, numbers)
        elif kind == LETTER:
            value = letters[args]
        elif kind == SUM:
            terms = (known[i] if c == 1 else known[i] * _number(c, numbers) for i, c in args[1])
            value = reduce(add, terms)
            value = value + _number(args[0], numbers) if args[0] else value
        elif kind == PRODUCT:
            powers = ((known[i], n) for i, n in args)
            value = reduce(mul, (
                a if n == 1 else a ** (int(n) if n.denominator == 1 else _number(n, numbers))
                for a, n in powers
            ))  # fmt: skip
        elif kind == HELD:
            value = known[args[0].values[args[1]].index]
        elif kind == RESULT:
            call, number = args
            if call not in known:
                own = (a.index for a in call.function.arguments)
                known[call] = dict(zip(own, (known[a.index] for a in call.arguments), strict=True))
            (value,) = _of_nodes([call.function.results[number]], letters, known[call], numbers)
        else:
            function, arguments = args if kind == CALL else (args, ())
            if arguments not in known:
                known[arguments] = {slot(k): known[i] for k, i in enumerate(arguments)}
            (value,) = _values([function], known[arguments], numbers)
        known[e.index] = value
    return [known[e.index] for e in nodes]


def _number(value: Rational, numbers: Arithmetic) -> Number:
    whole = value.denominator == 1
    return int(value) if whole else numbers.number(int(value.numerator)) / int(value.denominator)


def _values(
    expressions: Iterable[Expression], known: dict[Expression, Number], numbers: Any
) -> list[Number]:
    """Return the values of expressions; known: those of letters, to which others come."""
    functions = {**numbers.namespace(), "abs": abs}

    def value_of(e: Expression) -> Number:
        if e not in known:
            known[e] = computed(e)
        return known[e]

    def computed(e: Expression) -> Number:
        if not all(isinstance(a, sympy.Expr) for a in e.args):  # such as a condition
            raise refused(e)
        if not e.args:  # never ask sympy whether a sum is real: it would evaluate the sum's tables
            if e is sympy.zoo:  # a division by 0 that sympy did
                raise ZeroDivisionError("the expression divides by 0.")
            return numbers.imaginary_unit if e.is_real is False else numbers.number(e)
        parts = [value_of(a) for a in e.args]
        if e.is_Add or e.is_Mul:
            return reduce(add if e.is_Add else mul, parts)
        if e.is_Pow:
            return parts[0] ** (int(e.exp) if e.exp.is_Integer else parts[1])
        if hasattr(e, "in_arithmetic"):
            return e.in_arithmetic(numbers, parts)
        if name := FUNCTIONS.get(type(e).__name__):
            return functions[name](*parts)
        arguments = [a if a.is_number else sympy.Float(str(v), numbers.digits)
                     for a, v in zip(e.args, parts, strict=True)]  # fmt: skip
        value = e.func(*arguments)  # one of sympy's own, such as sign
        if not (value.is_number and value.is_real):
            raise refused(e)
        return numbers.number(value)

    return [value_of(e) for e in expressions]


def evaluate_matrix(
    matrix: SymbolicMatrix | NodeMatrix,
    digits: int,
    point: Mapping[Letter, Exact] | None = None,
    graph: Graph | None = None,
) -> SymbolicMatrix:
    """Return a matrix of sympy, or of nodes of the graph, at a point (`evaluate_at`), with its
    entries as Floats of sympy."""

    def decimal(value: Number) -> Expression:
        real, imag = sympy.Float(str(value.real), digits), value.imag
        return real + sympy.I * sympy.Float(str(imag), digits) if imag != 0 else real

    with arithmetic(digits).working():
        rows = matrix if isinstance(matrix, list) else matrix.tolist()
        values = evaluate_at([e for row in rows for e in row], point or {}, digits, graph)
        width = len(rows[0]) if isinstance(matrix, list) else matrix.cols
        return sympy.Matrix(len(rows), width, list(map(decimal, values)))


def number(expression: Expression, bits: int) -> Mpf:
    """Return an expression without symbols as an mpmath number that is right to so many bits."""
    digits = -(-bits * 30103 // 4_000_000) * 40 + 20  # few different precisions
    numbers = arithmetic(digits)
    with numbers.working():
        return numbers.public([evaluate(expression, digits)])[0]
