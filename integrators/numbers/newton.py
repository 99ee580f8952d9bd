"""Newton's method to round-off, in any arithmetic."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

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

    It ends (`over`) when a correction is round-off of the solution (or of `scale`), or when
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


# When an iteration is at its end: one text for every loop, compiled or in Python. The drivers of
# `compiler` have these functions as text, so they are of the compiled language. Sizes are of one
# correction in any norm; `noise` is the size of round-off in it.


def over(size: float, before: float, noise: float, following: float, small: bool) -> bool:
    """Return True if an iteration is at its end after a correction of this size.

    It is at its end if the correction is round-off, or if the `following` one, as it is estimated,
    would be; or if a `small` correction is not half of the one `before`: then only the round-off of
    the residual is left. Without an estimate, `following` is the size itself.
    """
    return size <= noise or following <= noise or (size > before / 2 and small)


def steepness(size: float, before: float, noise: float, kappa: float, count: int) -> float:
    """Return κ after `count` corrections: a correction of size s is followed by one of at most κs².

    κ is estimated anew in each run of Newton's method. Corrections below 64 round-offs are noise
    and tell only that κ is smaller than they would let it be.
    """
    if count > 1:
        if size > 64 * noise:
            seen = size / (before * before) if before > 0 else kappa
            if seen > kappa or count == 2:
                kappa = seen
        elif 64 * noise < kappa * before * before:
            kappa = 64 * noise / (before * before)
    return kappa
