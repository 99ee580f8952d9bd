"""What Python decides itself where a number is not known before the code runs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, reduce
from typing import Any

from .llvm_values import Value, mapped, register


def chosen(test: Any, yes: Callable[[], Any], no: Callable[[], Any]) -> Any:
    """`yes() if test else no()`; both are computed where the test is not known."""
    if isinstance(test, Value):
        return mapped(partial(_select, test), yes(), no())
    return yes() if test else no()


def _select(test: Value, yes: Any, no: Any) -> Value:
    kind = register(yes).kind if register(yes).kind == register(no).kind else "f"
    one, other = (test.routine.operand(kind, v) for v in (yes, no))
    return test.routine.get(kind, f"select i1 {test.name}, {one}, {other}")


def combined(both: bool, *parts: Any) -> Any:
    """`and` (or `or`) of all parts, which are all computed: none has an effect."""
    values = [p for p in parts if isinstance(p, Value)]
    if any(bool(p) is not both for p in parts if not isinstance(p, Value)):
        return not both
    word = "and" if both else "or"
    return reduce(lambda a, b: a.routine.get("b", f"{word} i1 {a.name}, {b.name}"),
                  values) if values else both  # fmt: skip


def negated(test: Any) -> Any:
    """`not test`."""
    if isinstance(test, Value):
        return test.routine.get("b", f"xor i1 {test.name}, true")
    return not test


def whole(number: Any) -> Any:
    """`int(number)`."""
    if isinstance(number, Value):
        return number.routine.get("i", f"fptosi {number.routine.operand('f', number)} to i64")
    return int(number)


def mathematical(name: str, plain: Callable[..., Any]) -> Callable[..., Any]:
    """A function of mathematics: `plain` where Python knows its arguments."""

    def function(*arguments: Any) -> Any:
        values = [a for a in arguments if isinstance(a, Value)]
        return values[0].routine.call(name, *arguments) if values else plain(*arguments)

    return function
