"""From one step as plain data to machine code, or to functions of numbers of any precision.

`compile(system, numbers, omit)` is all of it; a `KernelsAtStep` runs what it gives.
"""

from __future__ import annotations

from .cache import cache_folder, cached_text, imported, write_atomically
from .kernels import Kernels, compile, interpreted, kernel_text, names_of, text_key
from .kernels_at_step import KernelsAtStep, Run
from .layout import (
    BRANCH,
    CORRECTIONS,
    EDGE,
    FARTHEST,
    LAST_SIZE,
    MOST,
    NOT_CONVERGED,
    OK,
    REACH,
    SINGULAR,
    SLACK,
    STRAYED,
    Layout,
)
from .omissions import SAVINGS, is_affine
from .system import System

__all__ = [
    "BRANCH", "CORRECTIONS", "EDGE", "FARTHEST", "Kernels", "KernelsAtStep", "LAST_SIZE",
    "Layout", "MOST", "NOT_CONVERGED", "OK", "REACH", "Run", "SAVINGS", "SINGULAR", "SLACK",
    "STRAYED", "System", "cache_folder", "cached_text", "compile", "imported", "interpreted",
    "is_affine", "kernel_text", "names_of", "text_key", "write_atomically",
]  # fmt: skip
