"""Whether errors are a sum of powers of the step from one on, or a lower power is in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discmech.integrators.numbers import Vector

from ..core.limits import OF_ORDER

TERMS = 4  # successive powers of a sum; one more is tried before a lower power is
#: so many of the longest steps at most are left out, where more powers count; those that stay tell
#: a power from others over a factor of 10³ of the step
OUT, FEWEST = 8, 10
#: errors of some operations exceed the bound of one rounding so many times; a lower power is found
#: if it leaves so many times less than a higher one instead
ROUNDED, CLEARLY = OF_ORDER["powers: rounded"], OF_ORDER["powers: clearly"]
LAST = 6  # the shortest steps, at which a smooth error is gone, tell if a program rounds more
MOST = 10  # by so much more than that round-off may exceed its bound


@dataclass(frozen=True)
class Powers:
    """What the errors of a ladder of steps are made of.

    first: the first power of the sum that explains them to round-off, with its factor; None if no
    sum does. hidden: then the factor of the next lower power that what is left may hide.
    """

    first: int | None = None
    factor: float = 0.0
    hidden: float | None = None


def powers_of(steps: Sequence[float], errors: Vector, left: Vector, power: int) -> Powers:
    """Return whether signed errors (r,) are h^power and further ones to their round-off `left`.

    A lower power is looked for if they are not. Nothing is known of too few errors.
    """
    good = np.isfinite(errors) & (left > 0)
    h, e, unit = np.asarray(steps)[good], errors[good], left[good]
    if len(h) < FEWEST:
        return Powers()
    usual = max(1.0, min(MOST, float(np.abs(e[-LAST:] / unit[-LAST:]).max())))
    hidden = np.inf
    for first in range(min(OUT, len(h) - FEWEST) + 1):
        x, y, weight = h[first:] / h[first], e[first:], unit[first:]
        higher, factor = _rest(x, y, weight, [*range(power, power + TERMS + 1)])
        if higher <= ROUNDED * usual:
            return Powers(power, factor / h[first] ** power)
        for low in range(1, power):
            rest, factor = _rest(x, y, weight, [low, *range(power, power + TERMS)])
            if rest <= ROUNDED * usual and higher > CLEARLY * max(rest, 1.0):
                return Powers(low, factor / h[first] ** low)
        hidden = min(hidden, higher * weight[0] / h[first] ** (power - 1))
    return Powers(hidden=float(hidden))


def _rest(x: Vector, y: Vector, weight: Vector, powers: list[int]) -> tuple[float, float]:
    """Return (the largest error beside a sum of powers, over its weight; the first factor)."""
    columns = np.array([x**k for k in powers]).T / weight[:, None]
    sizes = np.abs(columns).max(axis=0)
    factors = np.linalg.lstsq(columns / sizes, y / weight)[0]
    return float(np.abs(columns / sizes @ factors - y / weight).max()), float(factors[0] / sizes[0])
