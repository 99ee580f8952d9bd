"""From nodes to straight-line Python, run on any kind of number.

One text serves machine code, numpy arrays, gmpy2 and mpmath: integers stay literal, other constants
are coefficients computed once in the arithmetic at hand. What is used several times has a name.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import count
from typing import TypeAlias

from .arithmetic import FUNCTIONS
from .graph import Graph
from .nodes import Node, Nodes
from .operations import (
    ADD,
    CALLED,
    ENTRY,
    INVERT,
    LEAF,
    LINES,
    MULTIPLY,
    POWER,
    Coefficients,
    Operations,
    Value,
)
from .types import Expression, Expressions, Letter

#: the binding strength of a text; one that is weaker than needed gets parentheses
_TERMS, _FACTORS, _FACTOR, _RAISED, _ATOM = range(5)
#: vectors of letters, or of the names of coefficients, by the name of the vector
Arguments: TypeAlias = Mapping[str, Iterable[Letter | str]]


def code(expression: Expression) -> str:
    """Return the Python text of one expression: plain arithmetic, small powers as products.

    Rationals are R(p)/q, R being the number type of the arithmetic. Raises `BadInput` for functions
    that no arithmetic has.
    """
    graph = Graph()
    operations = Operations(graph)
    (value,) = operations.values([graph.read(expression)])
    return Texts(operations, {}).of(value)


def function_text(
    name: str,
    arguments: Arguments,
    results: Sequence[Nodes | Expressions | Expression],
    coefficients: Coefficients | None = None,
) -> str:
    """Return the text of a function of vectors that returns tuples (for a column) and numbers.

    `arguments`: vector name → its letters, unpacked first. `results`: expressions of sympy, or
    nodes of one graph.
    """
    parts = [list(r) if hasattr(r, "__len__") else [r] for r in results]
    entries = [e for part in parts for e in part]
    graph = next((e.graph for e in entries if isinstance(e, Node)), None) or Graph()
    operations = Operations(graph, coefficients)
    with_arguments(operations, arguments)
    queue = iter(operations.values(graph.column(entries)))
    values = [[next(queue) for _ in part] for part in parts]
    return text_of(name, arguments, operations,
                   [v if hasattr(r, "__len__") else v[0]
                    for v, r in zip(values, results, strict=True)])  # fmt: skip


def coefficients_text(name: str, coefficients: Coefficients) -> str:
    """Return the text of the function of step and parameters that computes the coefficients."""
    graph = coefficients.graph
    operations = Operations(graph)
    names = [f"q{i}" for i in range(len(coefficients.q))]
    for letter, label in zip(graph.letters(coefficients.q), names, strict=True):
        operations.name(letter, label)
    return text_of(name, {"q": names}, operations, [operations.values(coefficients.values)])


def with_arguments(operations: Operations, arguments: Arguments) -> None:
    """Let the letters of arguments stand for themselves, whatever they are elsewhere."""
    for letters in arguments.values():
        named: Iterable[tuple[Letter, str]] = (
            (e, str(e)) for e in letters if not isinstance(e, str)
        )
        if isinstance(letters, Coefficients):
            named = zip(letters.q, letters, strict=True) if letters.plain else ()
        for letter, name in named:
            operations.name(operations.graph.node(letter), name)


def text_of(
    name: str,
    arguments: Arguments,
    operations: Operations,
    results: Sequence[Sequence[Value] | Value],
) -> str:
    """Return the text of a function of vectors; results: values, and columns of values."""
    roots = [v for r in results for v in (r if isinstance(r, Sequence) else [r])]
    lines, texts = body(operations, roots, arguments)
    rest, parts = iter(texts), []
    for result in results:
        if isinstance(result, Sequence):
            inner = [next(rest) for _ in result]
            parts.append(f"({', '.join(inner)}{',' if len(inner) == 1 else ''})")
        else:
            parts.append(next(rest))
    head = f"def {name}({', '.join(arguments)}):"
    return "\n".join([head, *lines, f"    return {', '.join(parts)}"]) + "\n"


def called_text(
    name: str, arguments: Sequence[Node], operations: Operations, results: Sequence[Value]
) -> tuple[str, dict[str, Node | None]]:
    """Return the text of a function of numbers, and what it uses beside its arguments, by name."""
    lines, texts = body(operations, results, {})
    own = [str(operations.graph.shown(e)) for e in arguments]
    more = {s: operations.letters[s] for s in sorted(_leaves(operations, results) - {*own})}
    head = f"def {name}({', '.join([*own, *more])}):"
    returned = f"    return {', '.join(texts)}{',' if len(texts) == 1 else ''}"
    return "\n".join([head, *lines, returned]) + "\n", more


def _leaves(operations: Operations, roots: Iterable[Value]) -> set[str]:
    """Return the names of the letters that roots use."""
    details, kinds = operations.details, operations.kinds
    used = {details[i] for i in operations.uses(roots) if kinds[i] == LEAF}
    return used & operations.letters.keys()


def body(
    operations: Operations, roots: Sequence[Value], arguments: Arguments
) -> tuple[list[str], list[str]]:
    """Return the statements of a function of vectors, and the texts of the roots."""
    operations.share(roots)
    used = _leaves(operations, roots)
    lines = [f"{s} = {vector}[{i}]" for vector, letters in arguments.items()
             for i, s in enumerate(letters) if str(s) in used]  # fmt: skip
    texts = Texts(operations, {})
    free = (name for i in count() if (name := f"t{i}") not in operations.letters)
    for number in _used_often(operations, roots):
        name = next(free)
        lines += texts.statements(number, name)
        texts.names[number] = name
    return [f"    {line}" for line in lines], [texts.of(v) for v in roots]


def _used_often(operations: Operations, roots: Iterable[Value]) -> list[int]:
    """Return the operations that get names, each after its parts: those that are used more than
    once, or have several results."""
    uses, kinds = operations.uses(roots), operations.kinds
    seen, numbers = set[int](), list[int]()
    pending = [(r >> 1, False) for r in roots][::-1]
    while pending:
        number, done = pending.pop()
        if done:
            numbers.append(number)
        elif number not in seen:
            seen.add(number)
            kind = kinds[number]
            if (uses[number] > 1 and kind != LEAF) or kind in (CALLED, LINES):
                pending.append((number, True))
            pending += [(p >> 1, False) for p in reversed(operations.parts[number])]
    return numbers


class Texts:
    """The texts of values; names: number of an operation → its name, if it has one."""

    def __init__(self, operations: Operations, names: dict[int, str]) -> None:
        self.operations, self.names = operations, names

    def of(self, value: Value) -> str:
        """Return the text of a value, with names for the parts that have one."""
        return self._text(value, _TERMS)

    def statements(self, number: int, name: str) -> list[str]:
        """Return the statements that give an operation its name."""
        operations = self.operations
        if operations.kinds[number] != LINES:
            return [f"{name} = {self._written(number, 0)[0]}"]
        texts = [self.of(p) for p in operations.parts[number]]
        lines: list[str] = operations.details[number].lines(name, texts)
        return lines

    def _text(self, value: Value, needed: int) -> str:
        number, minus = divmod(value, 2)
        if number in self.names:
            name = self.names[number]
            text, holds = (f"-{name}", _TERMS) if minus else (name, _ATOM)
        else:
            text, holds = self._written(number, minus)
        return text if holds >= needed else f"({text})"

    def _written(self, number: int, minus: int) -> tuple[str, int]:
        """Return the text of an operation or of its opposite, and its binding strength."""
        operations = self.operations
        kind, parts = operations.kinds[number], operations.parts[number]
        if kind == ADD and len(parts) > 1:
            return self._sum(self._terms(number, minus)), _TERMS
        if kind == ADD:
            return self._text(parts[0] ^ minus, _TERMS), _TERMS
        if kind == LEAF:
            text, holds = operations.details[number], _ATOM
        elif kind == MULTIPLY:
            text, holds = self._product(parts), _FACTORS
        elif kind == INVERT:
            text, holds = f"1/{self._text(parts[0], _RAISED)}", _FACTOR
        elif kind == POWER:
            text, holds = "**".join([self._text(p, _ATOM) for p in parts]), _RAISED
        else:
            text, holds = self._call(kind, operations.details[number], parts), _ATOM
        return (f"-{text}", _TERMS) if minus else (text, holds)

    def _terms(self, number: int, minus: int) -> list[Value]:
        """Return the terms of a sum or of its opposite, and those of sums in it without a name."""
        terms = list[Value]()
        for term in self.operations.parts[number]:
            inner = term >> 1
            if inner in self.names or self.operations.kinds[inner] != ADD:
                terms.append(term ^ minus)
            else:
                terms += self._terms(inner, (term ^ minus) % 2)
        return terms

    def _sum(self, terms: list[Value]) -> str:
        # a positive term first, and last the term that is known last: it then waits for no other
        depths = self.operations.depths
        terms.sort(key=lambda term: (term % 2, depths[term >> 1]))
        text = self._text(terms[0], _FACTORS if terms[0] % 2 == 0 else _TERMS)
        for term in terms[1:]:
            text += f" {'-' if term % 2 else '+'} {self._text(term & ~1, _FACTORS)}"
        return text

    def _product(self, factors: list[Value]) -> str:
        operations, below, above = self.operations, [], []
        for f in factors:
            number = f >> 1
            if number not in self.names and operations.kinds[number] == INVERT:
                below.append(operations.parts[number][0])
            else:
                above.append(f)
        text = "*".join(self._text(f, _FACTOR) for f in above) or "1"
        if below:
            texts = [self._text(f, _RAISED) for f in below]
            text += f"/{texts[0]}" if len(texts) == 1 else f"/({'*'.join(texts)})"
        return text

    def _call(self, kind: int, e: Expression, parts: list[Value]) -> str:
        if kind == ENTRY:
            several = self.operations.kinds[parts[0] >> 1] == CALLED
            place = f"[{e}]" if several else self.operations.details[parts[0] >> 1].place(e)
            return f"{self._text(parts[0], _ATOM)}{place}"
        if hasattr(e, "written"):
            texts = dict(zip(e.args, map(self.of, parts), strict=True))
            return str(e.written(texts.__getitem__))
        name = e if isinstance(e, str) else type(e).__name__
        return f"{FUNCTIONS.get(name, name)}({', '.join(map(self.of, parts))})"
