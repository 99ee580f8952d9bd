"""Arithmetic of generated elimination that skips structural zeros.

While instructions are written, an entry that no equation contains is Python's number 0. LLVM may
not drop 0·x, because x could be infinite or NaN; an elimination may, if the zero is structural.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import reduce

from .llvm_values import Operand, Value


def known_zero(e: Operand) -> bool:
    """Return True if `e` is a number 0, and no value that is known in machine code alone."""
    return not isinstance(e, Value) and bool(e == 0)


def as_number(one: Operand, e: Operand) -> Operand:
    """Return an entry as a number of the arithmetic of `one`; quotients of integers are rounded."""
    return 0.0 if known_zero(e) else one * e


def multiplied(a: Operand, b: Operand) -> Operand:
    """Return a b."""
    return 0.0 if known_zero(a) or known_zero(b) else a * b


def added(a: Operand, b: Operand) -> Operand:
    """Return a + b."""
    return b if known_zero(a) else a if known_zero(b) else a + b


def subtracted(a: Operand, b: Operand) -> Operand:
    """Return a − b."""
    return a if known_zero(b) else -b if known_zero(a) else a - b


def added_up(numbers: Iterable[Operand]) -> Operand:
    """Return the sum of the numbers."""
    return reduce(added, numbers, 0.0)


def inverse(e: Operand) -> Operand:
    """Return 1/e."""
    return math.inf if known_zero(e) else 1 / e


#: the names that a lattice's text uses
KNOWN_ZEROS = {f.__name__: f for f in
               (multiplied, added, subtracted, added_up, inverse, as_number)}  # fmt: skip
