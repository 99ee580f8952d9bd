"""Python's `sum` over expressions, with all terms added at once."""

from __future__ import annotations

import dis
from collections.abc import Callable, Iterable
from types import CodeType, FunctionType
from typing import Any

from ..numbers import sympy


def at_once(terms: Iterable[Any], /, start: Any = 0) -> Any:
    """Return `sum`; of expressions it is one sum, with the same terms in one order.

    Python adds one after another, and sympy sorts all of the terms again each time: five hundred
    springs take 1.5 s instead of 0.02.
    """
    given = list(terms)
    if (
        given
        and isinstance(start, int)
        and start == 0
        and all(isinstance(e, sympy.Expr) for e in given)
    ):
        return sympy.Add(*given)
    return sum(given, start)


def summing_at_once(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function with `at_once` as its `sum`, or itself if `sum` is not Python's.

    Functions that it calls are not changed, nor is a function that writes names of its module: it
    would write them elsewhere.
    """
    if (
        not isinstance(function, FunctionType)
        or "sum" not in function.__code__.co_names
        or "sum" in function.__globals__
        or _writes_globals(function.__code__)
    ):
        return function
    names = {**function.__globals__, "sum": at_once}
    other = FunctionType(function.__code__, names, function.__name__, function.__defaults__,
                         function.__closure__)  # fmt: skip
    other.__kwdefaults__ = function.__kwdefaults__
    return other


def _writes_globals(code: CodeType) -> bool:
    return any(
        e.opname in ("STORE_GLOBAL", "DELETE_GLOBAL")
        or (isinstance(e.argval, CodeType) and _writes_globals(e.argval))
        for e in dis.get_instructions(code)
    )
