"""Newton's method to round-off, in any arithmetic."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from .stop import over
from .types import Number, Vector

#: corrections: from a start in the basin some ten reach 50 digits, the others are for far starts
MOST = 60
#: units of round-off that a correction at a solution may have: the residual's last digits
ROUNDED = 4
#: units below which corrections that no longer halve are round-off of an ill-conditioned Jacobian;
#: larger ones wander, and the iteration continues
STAGNANT = 2**12


def newton(
    change: Callable[[Vector], Vector], start: Vector, scale: Number | Vector, eps: Number
) -> Vector | None:
    """Return the solution by Newton from `start` to round-off, or None; change: the correction.

    It ends (`stop.over`) when a correction is round-off of the solution (or of `scale`), or when
    corrections near it no longer halve; the next one is not estimated, for `change` may come from
    an approximate slope. Sizes are sums of absolute values; with a vector as scale each
    component is compared with its own, so that units do not matter. A component that is 0 except
    for products of round-offs has no such size: at a common solution it ends when it no longer
    halves.
    """
    point, before, least = start, math.inf, None
    for _ in range(MOST):
        try:
            step = change(point)
        except (ArithmeticError, ValueError):  # Python's own functions outside their domain
            return None
        point = point + step
        if isinstance(scale, np.ndarray):
            # a component that is corrected to exactly 0 has a size before
            sizes, own = abs(step), (scale, abs(point), abs(point - step))
            left = sizes != 0 if least is None else (sizes != 0) & (sizes < least / 2)
            whole = zip(sizes[left], *(of[left] for of in own), strict=True)
            size, unit = max((c / max(of) for c, *of in whole), default=0), eps
            if least is not None or sum(sizes) <= ROUNDED * eps * sum(abs(point)):
                least = sizes if least is None else np.minimum(sizes, least)
        else:
            size = sum(abs(c) for c in step)
            unit = eps * max(scale, sum(abs(c) for c in point))
        if not size < math.inf:  # nor is it nan
            return None
        if over(size, before, ROUNDED * unit, size, size < STAGNANT * unit):
            return point
        before = size
    return None
