"""Functions that return several numbers at once, inside symbolic expressions.

`entry(f(z), k)` is number k of what f returns. Common subexpressions being taken out, generated
text calls f once and reads its numbers by index. The text of f itself is registered under its name
and put in front of the text that calls it; its host supplies the decorators `helper` and `aside`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from typing import Any

from .lazy import sympy

_TEXTS: dict[str, Callable[[], str]] = {}
_COLLECTORS: list[Callable[[list[Any]], list[Any]]] = []


def register(name: str, text: Callable[[], str]) -> str:
    """Let generated text call the function of that name; `text()` defines it. Returns the name."""
    _TEXTS[name] = text
    return name


def collect(collector: Callable[[list[Any]], list[Any]]) -> Callable[[list[Any]], list[Any]]:
    """Decorator: expressions pass through this before their common subexpressions are taken out."""
    _COLLECTORS.append(collector)
    return collector


def together(expressions: list[Any]) -> list[Any]:
    """The expressions with functions that are cheaper together as entries of one table."""
    for collector in _COLLECTORS:
        expressions = collector(expressions)
    return expressions


def with_tables(text: str) -> str:
    """The text behind the definitions of all registered functions that it calls, each once."""
    found: dict[str, str] = {}
    seen: set[str] = set()

    def visit(calling: str) -> None:
        for name in sorted(set(re.findall(r"\b(\w+)\(", calling)) & set(_TEXTS) - seen):
            seen.add(name)
            definition = _TEXTS[name]()
            visit(definition)  # what it calls stands in front
            found[name] = definition

    visit(text)
    return "\n\n".join([*found.values(), text])


def entry(table: Any, index: int) -> Any:
    """Number `index` of the tuple or array that the sympy function `table` stands for.

    A table that is to be differentiated or evaluated has methods slope(index, s) and
    in_arithmetic(numbers, values of its arguments).
    """
    return _entry()(table, index)


@cache
def _entry() -> Any:
    from .evaluation import number

    class Entry(sympy.Function):
        nargs = 2

        def _eval_is_real(self) -> bool:
            return True

        def _eval_derivative(self, s: Any) -> Any:
            return self.args[0].slope(int(self.args[1]), s)

        def _eval_evalf(self, prec: int) -> Any:
            if not self.is_number:
                return None
            return sympy.Float._new(number(self, prec)._mpf_, prec)

        def in_arithmetic(self, numbers: Any, values: Any) -> Any:
            """The number itself, once the table is known."""
            return values[0][int(self.args[1])]

    return Entry


def held(expression: Any) -> Any:
    """The expression as one number that is rounded once: products with it are not merged."""
    if expression.is_Rational:
        return expression
    minus = expression.could_extract_minus_sign()
    return -_held()(-expression) if minus else _held()(expression)


@cache
def _held() -> Any:
    from .evaluation import number

    class Held(sympy.Function):
        nargs = 1

        @classmethod
        def eval(cls, value: Any) -> Any:
            return value if value.is_Rational else None

        def _eval_is_real(self) -> Any:
            return self.args[0].is_real

        def _eval_derivative(self, s: Any) -> Any:
            return self.args[0].diff(s)

        def _eval_evalf(self, prec: int) -> Any:
            return sympy.Float._new(number(self, prec)._mpf_, prec) if self.is_number else None

        def in_arithmetic(self, numbers: Any, values: Any) -> Any:
            """The number itself."""
            return values[0]

    return Held


def opaque(expression: Any) -> bool:
    """Whether the expression holds functions whose factors are better left standing."""
    kinds = {"Entry", "Held", "stumpff"}
    return any(type(f).__name__ in kinds for f in expression.atoms(sympy.Function))


def is_table(function: Any) -> bool:
    """Whether generated text may call it by its name."""
    return type(function).__name__ in _TEXTS
