"""The digits to which two results agree.

Each block (base, velocity, momentum, attitude) is measured by its largest error, relative to its
largest component at the start or at t, whichever is larger.
"""

from __future__ import annotations

import math
from typing import Any

Blocks = dict[str, list[Any]]  # "x", "v", "mu", "attitude" (row by row), as mpf numbers

EXACT = 10**6  # returned if both are equal


def said(digits: int) -> str:
    """Return the number of digits in words."""
    return "exactly" if digits == EXACT else f"to {digits} digits"


def agreement(one: Blocks, other: Blocks, start: Blocks) -> int:
    """Return the decimal digits to which two results agree, in their worst block."""
    import mpmath

    digits = math.inf
    with mpmath.workdps(15):
        for name, values in other.items():
            scale = max((abs(b) for b in (*values, *start.get(name, ()))), default=0)
            pairs = zip(one[name], values, strict=True)
            error = max((abs(a - b) for a, b in pairs), default=0)
            if not mpmath.isfinite(error):
                return 0
            if error:
                digits = min(digits, float(mpmath.log10((scale or 1) / error)))
    return EXACT if digits == math.inf else max(0, math.floor(digits))
