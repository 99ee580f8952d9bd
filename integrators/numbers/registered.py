"""Functions that generated text may call, by their names.

The text of one is put before the text that calls it; its host supplies the decorators `helper` and
`aside`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable

from .types import Expression

_TEXTS: dict[str, Callable[[], str]] = {}
#: functions ↦ {function: the entry of a table that computes several of them at once}
Collector = Callable[[Iterable[Expression]], dict[Expression, Expression]]

_COLLECTORS: list[Collector] = []


def register(name: str, text: Callable[[], str]) -> str:
    """Let generated text call the function of that name, defined by `text()`; return the name."""
    _TEXTS[name] = text
    return name


def with_tables(text: str) -> str:
    """Return the text after the definitions of the registered functions in it, each once."""
    parts, seen = list[str](), set[str]()

    def visit(calling: str) -> None:
        for name in sorted(set(re.findall(r"\b(\w+)\(", calling)) & set(_TEXTS) - seen):
            seen.add(name)
            visit(_TEXTS[name]())  # the functions that it calls come before
        parts.append(calling)

    visit(text)
    return "\n\n".join(parts)


def registered_names() -> list[str]:
    """Return the names of all functions that generated text may call."""
    return list(_TEXTS)


def is_table(function: Expression) -> bool:
    """True if generated text may call it by its name."""
    return type(function).__name__ in _TEXTS


def collect(collector: Collector) -> Collector:
    """Decorator: the functions of every generated text are given to this together."""
    _COLLECTORS.append(collector)
    return collector


def tabulated(functions: Iterable[Expression]) -> dict[Expression, Expression]:
    """Return the entries of tables that take the place of some of the functions."""
    return {f: e for collector in _COLLECTORS for f, e in collector(functions).items()}
