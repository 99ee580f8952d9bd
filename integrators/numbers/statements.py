"""Functions as straight-line Python: what is shared is computed once, in an order of use."""

from __future__ import annotations

import heapq
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeAlias

from .definitions import parts_of, symbols_of
from .lazy import sympy
from .multi_output import together
from .printing import code
from .types import Assignment, Expression, Expressions, Letter, Letters, Replacement


class Together(list[Expression], ABC):
    """Expressions whose values one statement or several define at once."""

    @abstractmethod
    def lines(self, names: list[str], texts: list[str]) -> list[str]:
        """The statements that define `names` from the texts of the expressions."""


MANY = 4000  # subexpressions from which their order is not worth its time


def _shared(outputs: Expressions) -> tuple[list[tuple[Letter, Expression]], list[Expression]]:
    """Common subexpressions taken out: ([(letter, value)], [each output])."""
    letters, given = sympy.numbered_symbols("t", real=True), together(list(outputs))
    # sorting all sums and products takes as long as all else where there are many
    order = "canonical" if len(parts_of(given)) < MANY else "none"
    shared, reduced = sympy.cse(given, symbols=letters, order=order, list=True)
    opposite: Replacement = {}  # −t costs nothing, and a name for it lengthens the text
    taken = []
    for name, value in shared:
        value = value.xreplace(opposite)
        if (-value).is_Symbol:
            opposite[name] = value
        else:
            taken.append((name, value))
    return taken, [e.xreplace(opposite) for e in reduced]


#: from the names of letters and the texts of their values to statements
Writer: TypeAlias = Callable[[list[str], list[str]], list[str]]
_Statement: TypeAlias = tuple[Letters, list[Expression], Writer]


class Call(Together):
    """The results of one call, from its arguments."""

    def __init__(self, function: str, arguments: Expressions) -> None:
        super().__init__(arguments)
        self.function = function

    def lines(self, names: list[str], texts: list[str]) -> list[str]:
        """One statement."""
        return [f"{', '.join(names)}, = {self.function}({', '.join(texts)})"]  # always a tuple


def function_text(
    name: str,
    arguments: dict[str, Iterable[Letter]],
    results: Sequence[Expressions | Expression],
    before: Sequence[Assignment] = (),
    scalars: Letters = (),
) -> str:
    """Text of a function of vectors (and scalars) that returns tuples (for a column) and numbers.

    `arguments`: vector name → its symbols, unpacked first. `before`: (symbols, values) computed in
    front, such as the points of a step, which the results may use; values `Together` make all
    their symbols at once.
    """
    columns = [list(r) if hasattr(r, "__iter__") else [r] for r in results]
    lines, texts = body(arguments, [e for column in columns for e in column], before)
    parts = []
    for result, column in zip(results, columns, strict=True):
        inner = ", ".join(next(texts) for _ in column)
        comma = "," if len(column) == 1 else ""
        parts.append(f"({inner}{comma})" if hasattr(result, "__iter__") else inner)
    head = f"def {name}({', '.join([*arguments, *map(str, scalars)])}):"
    return "\n".join([head, *lines, f"    return {', '.join(parts)}"]) + "\n"


def body(
    arguments: dict[str, Iterable[Letter]], results: Expressions, before: Sequence[Assignment]
) -> tuple[list[str], Iterator[str]]:
    """The statements of a function of vectors, and the texts of its results.

    Each letter is defined before it is used; the order is that of `before`, then of the common
    subexpressions, as far as it can be.
    """
    lines = [f"{s} = {vector}[{i}]" for vector, letters in arguments.items()
             for i, s in enumerate(letters)]  # fmt: skip
    taken, reduced = _shared([*(v for _, values in before for v in values), *results])
    rest = iter(reduced)
    pending: list[_Statement] = []
    for letters, values in before:
        made = [next(rest) for _ in values]
        if isinstance(values, Together):
            pending.append((letters, made, values.lines))
        else:
            pending += [([s], [e], _assign) for s, e in zip(letters, made, strict=True)]
    pending += [([s], [e], _assign) for s, e in taken]
    for letters, values, write in _by_use(pending):
        lines += write([str(s) for s in letters], [code(e) for e in values])
    return [f"    {line}" for line in lines], (code(e) for e in rest)


def _by_use(pending: Sequence[_Statement]) -> Iterator[_Statement]:
    """The statements in an order in which each uses letters of earlier ones: the first that can."""
    owner = {s: i for i, (letters, _, _) in enumerate(pending) for s in letters}
    uses = [{owner[s] for s in symbols_of(values) & owner.keys()} for _, values, _ in pending]
    users: dict[int, list[int]] = {}
    for i, used in enumerate(uses):
        for j in used:
            users.setdefault(j, []).append(i)
    ready = [i for i, used in enumerate(uses) if not used]
    while ready:
        i = heapq.heappop(ready)
        yield pending[i]
        for j in users.get(i, ()):
            uses[j].discard(i)
            if not uses[j]:
                heapq.heappush(ready, j)


def _assign(names: list[str], texts: list[str]) -> list[str]:
    return [f"{name} = {text}" for name, text in zip(names, texts, strict=True)]
