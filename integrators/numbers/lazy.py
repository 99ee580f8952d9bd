"""Sympy, mpmath and rooms of ours, loaded when a part of them is first used.

All threads share mpmath's number of digits, so they take turns: derivation and compilation run in
threads. The studies set digits by mpmath itself: their cases run in processes of their own.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from threading import RLock
from typing import Any


class LazyModule:
    """A stand-in for a module until one of its attributes is used."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        value = getattr(import_module(self._name), attribute)
        setattr(self, attribute, value)
        return value


sympy: Any = LazyModule("sympy")
mpmath = LazyModule("mpmath")
_turn = RLock()


@contextmanager
def uncollected() -> Iterator[None]:
    """Put off Python's search for unreachable cycles.

    One search through everything that sympy holds takes as long as all derivations of a scheme
    (50 ms), and derivations make many objects, but few cycles.
    """
    if not gc.isenabled():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


@contextmanager
def working_digits(digits: int) -> Iterator[None]:
    """Set mpmath to so many digits: of all threads that call this, only one at a time."""
    with _turn, mpmath.workdps(digits):
        yield


def on_demand(package: str, **names: str) -> Callable[[str], Any]:
    """Return the `__getattr__` of a package whose names are loaded when they are first used.

    `names` are those of each of its modules, separated by spaces, and none of them is a module's
    own: importing that would put it in the name's place. Raises `AttributeError` for any other.
    """
    module_of = {name: module for module, group in names.items() for name in group.split()}

    def found(name: str) -> Any:
        if name in names:
            return import_module(f"{package}.{name}")
        if name not in module_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(f"{package}.{module_of[name]}"), name)
        setattr(sys.modules[package], name, value)
        return value

    return found
