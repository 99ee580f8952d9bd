"""Threads of linear algebra: one a process, since cases run side by side as processes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

#: what libraries of linear algebra read when they are loaded: all, OpenBLAS, MKL, Accelerate
SETTINGS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


@contextmanager
def one_thread() -> Iterator[None]:
    """Where none of them is set, what is loaded or begun meanwhile has one thread.

    Matrices here are small. On busy cores threads that wait for each other make products of them
    twenty times as slow (optimal control of a reorientation by gauss-2).
    """
    settings = [] if set(SETTINGS) & set(os.environ) else SETTINGS
    os.environ.update(dict.fromkeys(settings, "1"))
    try:
        yield
    finally:
        for name in settings:
            os.environ.pop(name, None)
