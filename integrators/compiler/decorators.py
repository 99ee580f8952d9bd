"""Decorators of the drivers' functions: how machine code is written for them (`llvm_writer.KINDS`).

Python runs the functions unchanged.
"""

from __future__ import annotations

from typing import TypeVar

Function = TypeVar("Function")


def kernel(function: Function) -> Function:
    """Return the function."""
    return function


aside = node = ordered = kernel
