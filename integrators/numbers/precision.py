"""The digits that mpmath works with: all threads share them, so they take turns.

What derives and compiles runs in threads. The studies set digits by mpmath itself: their cases run
in processes of their own.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock
from typing import Any

from .lazy import LazyModule

mpmath: Any = LazyModule("mpmath")
_turn = RLock()


@contextmanager
def working_digits(digits: int) -> Iterator[None]:
    """mpmath at so many digits: of all threads that ask here, this one alone."""
    with _turn, mpmath.workdps(digits):
        yield
