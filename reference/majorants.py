"""Power series by the sizes of their terms: norms, tails and lower bounds, rounded up.

A node of the tape is a polynomial a on |t| <= H with |a| = sum_k |a_k| H^k, which bounds it on the
whole disc, and an error r, its distance to the true value there.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate
from typing import Any


class Unproven(ArithmeticError):
    """No rigorous bound is found for these equations, or for steps of this size."""


def upward() -> Any:
    """The arithmetic of bounds: 53 bits, rounded up."""
    import gmpy2

    return gmpy2.context(gmpy2.get_context(), precision=53, round=gmpy2.RoundUp)


@dataclass(frozen=True)
class Majorant:
    """|a_k| H^k for k = 0 ... N, the sums of them from k on, and the node's error r."""

    series: list[Any]  # a_k itself, unrounded
    terms: list[Any]
    tails: list[Any]
    error: Any = 0
    backward: bool = False

    @property
    def norm(self) -> Any:
        """sum_k |a_k| H^k."""
        return self.tails[0]

    def least(self) -> Any:
        """A positive lower bound of the true |node| on the step; raises `Unproven`."""
        import gmpy2

        head = abs_exact(self.series[0])
        bound = -(self.tails[1] + self.error - head)
        if not 8 * bound > head:
            bound = max(bound, -(self.error - self._least_on_parts()))
        if not (gmpy2.is_finite(bound) and bound > 0):
            raise Unproven("a denominator, root or absolute value comes near zero in one step")
        return bound

    def _least_on_parts(self) -> Any:
        """The polynomial's least size for 0 <= t/size <= 1, from the middles of 64 parts."""
        import gmpy2
        import numpy as np

        parts = 64
        sizes = np.array([float(term) for term in self.terms])
        signs = [1 if a > 0 else -1 for a in self.series]
        if self.backward:
            signs[1::2] = [-sign for sign in signs[1::2]]
        signed = sizes[: len(signs)] * signs
        middle = (np.arange(parts) + 0.5) / parts
        values = np.polynomial.polynomial.polyval(middle, signed)
        sway = (sizes @ range(len(sizes))) / (2 * parts)
        least = abs(values).min() if abs(np.sign(values).sum()) == parts else -1.0
        return gmpy2.mpfr(float(least - (sway + 1e-12 * sizes.sum()) * (1 + 1e-9)))

    def slopes(self) -> Majorant:
        """k |a_k| H^k: the derivative, times H."""
        import gmpy2

        return majorant([], list(map(gmpy2.mul, self.terms, range(len(self.terms)))))


def abs_exact(value: Any) -> Any:
    """|value| with all its bits."""
    return -value if value < 0 else value


def majorant(series: list[Any], terms: list[Any], backward: bool = False) -> Majorant:
    """With the tails summed."""
    tails = list(accumulate(reversed(terms)))[::-1]
    return Majorant(series, terms, tails, backward=backward)


def high(a: Majorant, b: Majorant) -> Any:
    """sum_{i+j >= N} |a_i||b_j| H^{i+j}."""
    import gmpy2

    return gmpy2.fsum(map(gmpy2.mul, a.terms, reversed(b.tails)))
