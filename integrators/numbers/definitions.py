"""Letters that stand for expressions, and functions called from several places.

Large expressions are split into small ones with a letter each. A list of definitions is ordered:
each uses the letters of earlier ones, and letters that the reader supplies.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from .graph import HELD, Graph, Group, Node
from .lazy import sympy
from .types import Expression, Letter, Letters, Replacement


@dataclass(frozen=True, eq=False)
class Function:
    """A function of numbers with several results, written once and called from several places.

    `definitions` are computed inside it; `results` are expressions in `arguments`, in letters that
    every caller has (x, y, q) and in letters of the definitions.
    """

    name: str
    arguments: Letters
    definitions: tuple[Definition, ...]
    results: tuple[Expression, ...]


@dataclass(frozen=True, eq=False)
class Definition:
    """Letters and what they stand for: `values`, or the results of `function` at `arguments`."""

    letters: Letters
    values: tuple[Expression, ...] = ()
    function: Function | None = None
    arguments: Letters = ()

    @property
    def holds(self) -> set[Letter]:
        """All letters that occur in its values."""
        if self.function is None:
            return symbols_of(self.values)
        inner = symbols_of(self.function.results)
        for definition in reversed(self.function.definitions):
            inner |= definition.holds
        own = {s for d in self.function.definitions for s in d.letters}
        return (inner - own - set(self.function.arguments)) | symbols_of(self.arguments)


def parts_of(expressions: Iterable[Expression]) -> set[Expression]:
    """Return all subexpressions, each visited once: sympy's `atoms` visits shared ones again."""
    seen, pending = set[Any](), list(expressions)
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


def needed(
    definitions: Sequence[Definition],
    expressions: Iterable[Expression],
    known: Iterable[Letter] = (),
) -> list[Definition]:
    """Return the definitions that the expressions use, directly or through others, in order.

    Functions are reduced to the results that any of their calls needs. Letters of `known` need no
    definition.
    """
    wanted, chosen = symbols_of(expressions) - set(known), list[Definition]()
    for definition in reversed(definitions):
        if wanted & set(definition.letters):
            chosen.insert(0, definition)
            wanted |= definition.holds - set(known)
    used: dict[Function, set[int]] = {}
    for d in chosen:
        if d.function is not None:
            indices = {i for i, letter in enumerate(d.letters) if letter in wanted}
            used.setdefault(d.function, set()).update(indices)
    reduced = {}
    for f, indices in used.items():
        results = tuple(f.results[i] for i in sorted(indices))
        inner = tuple(needed(f.definitions, results))
        reduced[f] = replace(f, results=results, definitions=inner)
    return [
        d if d.function is None else replace(
            d, function=reduced[d.function],
            letters=tuple(d.letters[i] for i in sorted(used[d.function])),
        )
        for d in chosen
    ]  # fmt: skip


def inlined(definitions: Sequence[Definition]) -> list[Definition]:
    """Return the definitions with every call replaced by the values of its function."""
    plain: list[Definition] = []
    for number, d in enumerate(definitions):
        if d.function is None:
            plain.append(d)
            continue
        f = d.function
        rename = dict(zip(f.arguments, d.arguments, strict=True))
        for inner in inlined(f.definitions):
            own = tuple(sympy.Symbol(f"{s}_of_{number}", real=True) for s in inner.letters)
            plain.append(Definition(own, tuple(replaced(inner.values, rename))))
            rename |= dict(zip(inner.letters, own, strict=True))
        plain.append(Definition(d.letters, tuple(replaced(f.results, rename))))
    return plain


def written_out(definitions: Sequence[Definition], expression: Expression) -> Expression:
    """Return the expression (or matrix) with every defined letter replaced by its value."""
    for d in reversed(inlined(definitions)):
        expression = expression.xreplace(dict(zip(d.letters, d.values, strict=True)))
    return expression


@dataclass(eq=False)
class _Called:
    """A function in nodes, or a call of one: at its own letters, or at those of a caller."""

    function: Any
    arguments: list[Node]
    name: str = ""
    scope: Any = None
    results: list[Node] = field(default_factory=list)

    def at(self, arguments: list[Node]) -> _Called:
        """Return the call at other arguments."""
        return _Called(self.function, arguments)


def read_definitions(
    graph: Graph, definitions: Iterable[Definition], scope: Any = "step",
    known: dict[Function, _Called] | None = None,
) -> None:  # fmt: skip
    """Let the letters of definitions stand for held values, and for results of calls."""
    known = {} if known is None else known
    for d in definitions:
        if (f := d.function) is None:
            for letter, value in zip(d.letters, d.values, strict=True):
                group = Group(scope, [letter], [graph.read(value)], named=False)
                graph.name([letter], [graph.make(HELD, (group, 0))])
            continue
        if f not in known:
            read_definitions(graph, f.definitions, f, known)
            results = [graph.read(e) for e in f.results]
            known[f] = _Called(None, graph.letters(f.arguments), f.name, f, results)
        call = _Called(known[f], [graph.read(e) for e in d.arguments])
        results = [graph.result(call, i) for i in range(len(d.letters))]
        graph.name(d.letters, results)
