"""Python's `sum` over expressions, whose terms are added all at once."""

from __future__ import annotations

import builtins
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from ..numbers import sympy

_sum = builtins.sum


def at_once(terms: Iterable[Any], /, start: Any = 0) -> Any:
    """`sum`; where all terms are expressions, one sum of them, with the same terms in one order.

    Python adds one after another, and sympy sorts all of the terms again each time: five hundred
    springs take 1.5 s instead of 0.02.
    """
    given = list(terms)
    if given and start == 0 and all(isinstance(e, sympy.Expr) for e in given):
        return sympy.Add(*given)
    return _sum(given, start)


@contextmanager
def sums_at_once() -> Iterator[None]:
    """While a function of the user's is evaluated with symbols, `sum` is `at_once`.

    Whatever else asks for a sum meanwhile gets what it gets from Python.
    """
    builtins.sum = at_once
    try:
        yield
    finally:
        builtins.sum = _sum
