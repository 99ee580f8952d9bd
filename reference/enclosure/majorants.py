"""Power series by the sizes of their terms: norms, tails and lower bounds, rounded up.

A node of the tape has a polynomial a on |t| <= H with |a| = sum_k |a_k| H^k, which bounds it on the
whole disc, and an error r, its distance from the true value there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from itertools import accumulate
from typing import Any

import gmpy2
from flint import arb, arb_poly

from ..failures import Unproven
from ..taylor.balls import around_zero, exact, rounded, working


def upward() -> Any:
    """Return the arithmetic of bounds: 53 bits, rounded up."""
    return gmpy2.context(gmpy2.get_context(), precision=53, round=gmpy2.RoundUp)


@dataclass(frozen=True)
class Majorant:
    """The terms |a_k| H^k for k = 0 ... N, their sums from k on, and the node's error r."""

    series: list[Any]  # a_k itself, unrounded
    terms: list[Any]
    tails: list[Any]
    size: Any = 0  # t at the step's end, with its sign
    error: Any = 0

    @property
    def norm(self) -> Any:
        """The norm sum_k |a_k| H^k."""
        return self.tails[0]

    def least(self) -> Any:
        """Return a positive lower bound of the true |node| on the step; raises `Unproven`."""
        head = abs_exact(self.series[0])
        bound = -(self.tails[1] + self.error - head)
        if not 8 * bound > head:
            bound = max(bound, -(self.error - self._least_on_parts()))
        if not (gmpy2.is_finite(bound) and bound > 0):
            raise Unproven("a denominator, root or absolute value comes near zero in one step")
        return bound

    def _least_on_parts(self) -> Any:
        """Return the polynomial's least size for 0 <= t/size <= 1, by mean values on 64 parts."""
        parts, bounds = 64, []
        with working():
            size, path = exact(self.size), arb_poly([exact(a) for a in self.series])
            slope, sway = path.derivative(), around_zero(size / (2 * parts))
            for i in range(parts):
                middle = size * (2 * i + 1) / (2 * parts)
                bounds.append(-(path(middle) + slope(middle + sway) * sway).abs_lower())
            return -rounded(reduce(arb.max, bounds))

    def slopes(self) -> Majorant:
        """Return the terms k |a_k| H^k of the derivative times H."""
        return majorant([], list(map(gmpy2.mul, self.terms, range(len(self.terms)))))


def abs_exact(value: Any) -> Any:
    """Return |value| with all its bits."""
    return -value if value < 0 else value


def majorant(series: list[Any], terms: list[Any], size: Any = 0) -> Majorant:
    """Return the majorant with its tails summed."""
    tails = list(accumulate(reversed(terms)))[::-1]
    return Majorant(series, terms, tails, size)


def high(a: Majorant, b: Majorant) -> Any:
    """Return sum_{i+j >= N} |a_i||b_j| H^{i+j}."""
    return gmpy2.fsum(map(gmpy2.mul, a.terms, reversed(b.tails)))
