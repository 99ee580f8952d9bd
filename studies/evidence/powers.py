"""Whether errors are a sum of powers of the step from one on, or a lower power is in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import starmap
from typing import TypeAlias

import numpy as np

from discmech.integrators.numbers import Vector

from ..core.limits import OF_ORDER

#: steps, signed errors and bounds of their round-off, (r,) each
Ladder: TypeAlias = tuple[Sequence[float], Vector, Vector]
TERMS = 4  # successive powers of a sum; one more is tried before a lower power is
#: so many of the longest steps at most are left out, where more powers count; those that stay tell
#: a power from others over a factor of 10³ of the step
OUT, FEWEST = 8, 10
#: errors of some operations exceed the bound of one rounding so many times; a lower power is found
#: if it leaves so many times less than a higher one instead
ROUNDED, CLEARLY = OF_ORDER["powers: rounded"], OF_ORDER["powers: clearly"]
TOGETHER = OF_ORDER["powers: together"]
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
    h, e, unit, usual = _known(steps, errors, left)
    if len(h) < FEWEST:
        return Powers()
    (own, *lower), hidden = _sums(power), np.inf
    for first in range(min(OUT, len(h) - FEWEST) + 1):
        x, y, weight = h[first:] / h[first], e[first:], unit[first:]
        rests, factor = beside_sum(x, y, weight, own)
        higher = float(np.abs(rests).max())
        if higher <= ROUNDED * usual:
            return Powers(power, factor / h[first] ** power)
        for low, powers in enumerate(lower, 1):
            rests, factor = beside_sum(x, y, weight, powers)
            rest = float(np.abs(rests).max())
            if rest <= ROUNDED * usual and higher > CLEARLY * max(rest, 1.0):
                return Powers(low, factor / h[first] ** low)
        hidden = min(hidden, higher * weight[0] / h[first] ** (power - 1))
    return Powers(hidden=float(hidden))


def lower_together(ladders: Sequence[Ladder], power: int) -> tuple[int, Powers] | None:
    """Return (the ladder that shows it most, a lower power in all errors together), or None.

    In one component from one place a small lower power may hide among roundings, which are others
    in each. So the squares of what both sums leave are added over all places and components.
    """
    known = list(starmap(_known, ladders))
    for first in range(OUT + 1) if power > 1 else ():
        these = [k for k, (h, *_) in enumerate(known) if len(h) >= FEWEST + first]
        parts = [(h[first:] / h[first], e[first:], usual * unit[first:])
                 for h, e, unit, usual in map(known.__getitem__, these)]  # fmt: skip
        rests = [[beside_sum(*part, powers)[0] for part in parts] for powers in _sums(power)]
        most = [max((np.abs(e).max() for e in each), default=np.inf) for each in rests]
        squares = np.array([[e @ e for e in each] for each in rests])
        low = int(squares[1:].sum(axis=1).argmin()) + 1
        if most[low] <= ROUNDED and squares[0].sum() > TOGETHER * squares[low].sum():
            worst = int((squares[0] - squares[low]).argmax())
            factor = beside_sum(*parts[worst], _sums(power)[low])[1]
            at = these[worst]
            return at, Powers(low, factor / known[at][0][first] ** low)
        if most[0] <= ROUNDED:
            break
    return None


def _sums(power: int) -> list[list[int]]:
    """Return the powers of the sum from that one on, and of those with each lower one."""
    return [[*range(power, power + TERMS + 1)],
            *([low, *range(power, power + TERMS)] for low in range(1, power))]  # fmt: skip


def _known(
    steps: Sequence[float], errors: Vector, left: Vector
) -> tuple[Vector, Vector, Vector, float]:
    """Return the steps, errors and round-offs that are known, and how much more it rounds."""
    good = np.isfinite(errors) & (left > 0)
    h, e, unit = np.asarray(steps)[good], errors[good], left[good]
    usual = float(np.abs(e[-LAST:] / unit[-LAST:]).max(initial=0.0))
    return h, e, unit, max(1.0, min(MOST, usual))


def beside_sum(x: Vector, y: Vector, weight: Vector, powers: Sequence[int]) -> tuple[Vector, float]:
    """Return (a sum of powers of x beside the errors y, over their weight; its first factor)."""
    columns = np.array([x**k for k in powers]).T / weight[:, None]
    sizes = np.abs(columns).max(axis=0)
    factors = np.linalg.lstsq(columns / sizes, y / weight)[0]
    return columns / sizes @ factors - y / weight, float(factors[0] / sizes[0])
