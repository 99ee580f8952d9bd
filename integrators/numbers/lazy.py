"""Sympy and mpmath, loaded when first used: importing this package stays light."""

from __future__ import annotations

from importlib import import_module
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
