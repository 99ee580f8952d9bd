"""Settings that libraries and processes read when they are loaded or started."""

from __future__ import annotations

import atexit
import gc
import os
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

#: threads of linear algebra: all libraries, OpenBLAS, MKL, Accelerate
SETTINGS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


@contextmanager
def environment(settings: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables within the context."""
    before = {name: os.environ.get(name) for name in settings}
    os.environ.update(settings)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


_begun: list[Path] = []


@contextmanager
def names_from(folder: Path) -> Iterator[None]:
    """Take relative names within the context from that folder.

    A user's file may change the current folder; the names that were typed stay where they were.
    """
    _begun.append(folder)
    try:
        yield
    finally:
        _begun.pop()


def absolute(name: Path | str) -> Path:
    """Return the path of a name that was typed."""
    return (here() / name).absolute()


def here() -> Path:
    """Return the folder from which relative names are taken."""
    return _begun[-1] if _begun else Path()


def one_thread() -> AbstractContextManager[None]:
    """Give linear algebra one thread in libraries loaded and processes started within the context.

    It changes nothing if a number of threads is set. Cases run side by side as processes, and
    matrices here are small. On busy cores threads that wait for each other make products of them
    twenty times as slow (optimal control of a reorientation by gauss-2).
    """
    return environment({} if set(SETTINGS) & set(os.environ) else dict.fromkeys(SETTINGS, "1"))


def collect_rarely() -> None:
    """Make the garbage collector run less often in a process of ours, and not at its end.

    Expressions are many small objects that stay: going through them at every run of the collector
    costs a tenth of the processor time, and at the end half a second.
    """
    gc.set_threshold(200_000, 50, 100)
    atexit.register(gc.freeze)
