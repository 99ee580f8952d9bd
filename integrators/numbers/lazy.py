"""Sympy and mpmath, loaded when something of them is first used: this package stays light.

All threads share the digits that mpmath works with, so they take turns: what derives and compiles
runs in threads. The studies set digits by mpmath itself: their cases run in processes of their own.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from threading import RLock
from typing import Any


class LazyModule:
    """Stands for a module until an attribute of it is asked for."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        value = getattr(import_module(self._name), attribute)
        setattr(self, attribute, value)
        return value


sympy: Any = LazyModule("sympy")
mpmath: Any = LazyModule("mpmath")
_turn = RLock()


@contextmanager
def working_digits(digits: int) -> Iterator[None]:
    """mpmath at so many digits: of all threads that ask here, this one alone."""
    with _turn, mpmath.workdps(digits):
        yield
