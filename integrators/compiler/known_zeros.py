"""Arithmetic of generated elimination that leaves out what Python knows to be 0.

While instructions are written, an entry that no equation holds is the number 0 of Python's. LLVM
may not drop 0·x, which could be no number; an elimination may, where the zero is one by structure.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import reduce
from typing import Any


def known_zero(e: Any) -> bool:
    """Whether it is the number 0 of Python's."""
    return isinstance(e, (int, float)) and e == 0


def multiplied(a: Any, b: Any) -> Any:
    """a b."""
    return 0.0 if known_zero(a) or known_zero(b) else a * b


def added(a: Any, b: Any) -> Any:
    """a + b."""
    return b if known_zero(a) else a if known_zero(b) else a + b


def subtracted(a: Any, b: Any) -> Any:
    """a − b."""
    return a if known_zero(b) else -b if known_zero(a) else a - b


def added_up(numbers: Iterable[Any]) -> Any:
    """The sum of numbers."""
    return reduce(added, numbers, 0.0)


def inverse(e: Any) -> Any:
    """1/e."""
    return math.inf if known_zero(e) else 1 / e


#: names of a lattice's text
KNOWN_ZEROS = {f.__name__: f for f in (multiplied, added, subtracted, added_up, inverse)}
