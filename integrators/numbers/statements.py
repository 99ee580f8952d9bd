"""Functions as straight-line Python: shared parts are computed once, in an order of use."""

from __future__ import annotations

import heapq
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import count
from typing import TypeAlias

from .expression_graph import AS_WRITTEN, LEAF, AsWritten, ExpressionGraph, Value
from .multi_output import together
from .printing import Texts
from .types import Assignment, Expression, Expressions, Letter, Letters


class Together(list[Expression], ABC):
    """Expressions whose values one statement or several define at once."""

    @abstractmethod
    def lines(self, names: list[str], texts: list[str]) -> list[str]:
        """Return the statements that define `names` from the texts of the expressions."""


#: (names of letters, texts of their values) ↦ statements
Writer: TypeAlias = Callable[[list[str], list[str]], list[str]]
#: (names, texts of their values, the names and letters in these, their writer)
_Statement: TypeAlias = tuple[list[str], list[str], set[str], Writer]


class Call(Together):
    """The results of one call, from its arguments."""

    def __init__(self, function: str, arguments: Expressions) -> None:
        super().__init__(arguments)
        self.function = function

    def lines(self, names: list[str], texts: list[str]) -> list[str]:
        """Return one statement."""
        return [f"{', '.join(names)}, = {self.function}({', '.join(texts)})"]  # always a tuple


def function_text(
    name: str,
    arguments: dict[str, Iterable[Letter]],
    results: Sequence[Expressions | Expression],
    before: Sequence[Assignment] = (),
    reading: AsWritten = AS_WRITTEN,
) -> str:
    """Return the text of a function of vectors that returns tuples (for a column) and numbers.

    `arguments`: vector name → its symbols, unpacked first. `before`: (symbols, values) computed
    first, such as the points of a step, which the results may use; values `Together` define all
    their symbols at once. reading: how expressions are read (`Coefficients`).
    """
    lines, texts, _ = body(arguments, _entries(results), before, reading)
    return _with_head(name, arguments, lines, _returned(results, texts))


def called_text(
    name: str,
    arguments: Letters,
    results: Expressions,
    before: Sequence[Assignment],
    reading: AsWritten,
) -> tuple[str, list[Letter]]:
    """Return the text of a function of numbers, and the letters that follow its arguments."""
    lines, texts, letters = body({}, results, before, reading)
    own = {*map(str, arguments), *(str(s) for defined, _ in before for s in defined)}
    taken = sorted(letters.keys() - own)
    text = _with_head(name, [*map(str, arguments), *taken], lines, _returned([results], texts))
    return text, [letters[s] for s in taken]


def _entries(results: Sequence[Expressions | Expression]) -> list[Expression]:
    return [e for r in results for e in (r if hasattr(r, "__len__") else [r])]


def _returned(results: Sequence[Expressions | Expression], texts: Iterator[str]) -> str:
    parts = []
    for result in results:
        if hasattr(result, "__len__"):
            inner = [next(texts) for _ in result]
            parts.append(f"({', '.join(inner)}{',' if len(inner) == 1 else ''})")
        else:
            parts.append(next(texts))
    return ", ".join(parts)


def _with_head(name: str, arguments: Iterable[str], lines: list[str], returned: str) -> str:
    head = f"def {name}({', '.join(arguments)}):"
    return "\n".join([head, *lines, f"    return {returned}"]) + "\n"


def body(
    arguments: dict[str, Iterable[Letter]],
    results: Expressions,
    before: Sequence[Assignment],
    reading: AsWritten = AS_WRITTEN,
) -> tuple[list[str], Iterator[str], dict[str, Letter]]:
    """Return the statements of a function of vectors, the texts of its results, and its letters.

    Each letter is defined before it is used; the order is that of `before`, then of the common
    subexpressions, as far as possible.
    """
    graph = ExpressionGraph(reading)
    roots = graph.values(together([*(v for _, values in before for v in values), *results]))
    lines = [f"{s} = {vector}[{i}]" for vector, letters in arguments.items()
             for i, s in enumerate(letters) if str(s) in graph.letters]  # fmt: skip
    graph.share()
    names = _named(graph, roots, {str(s) for letters, _ in before for s in letters})
    texts, rest = Texts(graph, names), iter(roots)
    pending: list[_Statement] = []
    for letters, values in before:
        defined, made = list(map(str, letters)), [next(rest) for _ in values]
        if isinstance(values, Together):
            pending.append((defined, *texts.with_letters(made), values.lines))
        else:
            pending += [([s], *texts.with_letters([value]), _assign)
                        for s, value in zip(defined, made, strict=True)]  # fmt: skip
    pending += [([name], *texts.inside(node), _assign) for node, name in names.items()]
    for defined, given, _, write in _by_use(pending):
        lines += write(defined, given)
    return [f"    {line}" for line in lines], map(texts.of, rest), graph.letters


def _named(graph: ExpressionGraph, roots: list[Value], taken: set[str]) -> dict[int, str]:
    """Return names for the values that are used more than once, each after its parts."""
    uses = graph.uses(roots)
    taken |= graph.letters.keys()
    free = (name for i in count() if (name := f"t{i}") not in taken)
    seen, names = set[int](), dict[int, str]()

    def visit(node: int) -> None:
        seen.add(node)
        for part in graph.parts[node]:
            if part >> 1 not in seen:
                visit(part >> 1)
        if uses[node] > 1 and graph.kinds[node] != LEAF:
            names[node] = next(free)

    for root in roots:
        if root >> 1 not in seen:
            visit(root >> 1)
    return names


def _by_use(pending: Sequence[_Statement]) -> Iterator[_Statement]:
    """Yield the statements so that each uses letters of earlier ones: always the first that can."""
    owner = {name: i for i, (names, *_) in enumerate(pending) for name in names}
    uses = [{owner[name] for name in used & owner.keys()} for _, _, used, _ in pending]
    users: dict[int, list[int]] = {}
    for i, used in enumerate(uses):
        for j in used:
            users.setdefault(j, []).append(i)
    ready = [i for i, used in enumerate(uses) if not used]
    done = 0
    while ready:
        i = heapq.heappop(ready)
        done += 1
        yield pending[i]
        for j in users.get(i, ()):
            uses[j].discard(i)
            if not uses[j]:
                heapq.heappush(ready, j)
    assert done == len(pending), "a letter is defined by itself"


def _assign(names: list[str], texts: list[str]) -> list[str]:
    return [f"{name} = {text}" for name, text in zip(names, texts, strict=True)]
