"""A reference: the state at a time, its certain digits and their evidence."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, Literal

from .agreement import Blocks

Certainty = Literal["enclosure", "defect bound", "agreement"]


@dataclass(frozen=True)
class Solution:
    """The state of a scene at time t, as mpf numbers with more digits than are certain.

    x (dim_x), v (dim_u) natural velocity, mu (dim_u) = dl/dv, attitude (N x N mpmath matrix with
    A(0) = identity, dA/dt = A v^) or None; ``certain_digits`` of each of them; ``certainty``: an
    "enclosure" (proven), a "defect bound" (proven defect, growth to first order) or "agreement" (of
    settings and methods); ``evidence`` in words; ``bound``: the error bound relative to the largest
    component of a block, an mpf, or None for agreement. It holds for the numbers as computed; a
    file rounds them to three digits more than are certain.
    """

    t: Fraction
    x: list[Any]
    mu: list[Any]
    v: list[Any]
    attitude: Any
    certain_digits: int
    method: str
    evidence: str
    certainty: Certainty = "agreement"
    bound: Any = None

    def limited_to(self, digits: int, attitude: bool) -> Solution:
        """Return the answer for fewer digits, or without the attitude."""
        kept = self.attitude if attitude else None
        return replace(self, certain_digits=min(digits, self.certain_digits), attitude=kept)


@dataclass(frozen=True)
class Finding:
    """A preliminary `Solution`: remarks may still lower its certain digits."""

    t: Fraction
    blocks: Blocks
    certain: int
    certainty: Certainty
    method: str
    evidence: str
    bound: Any = None

    def remarked(self, remark: str) -> Finding:
        """Return the finding with a remark in the evidence."""
        return replace(self, evidence=f"{self.evidence}; {remark}")

    def limited(self, certain: int, remark: str, enough: int) -> Finding:
        """Return the finding with at most ``certain`` digits; below ``enough`` it is no proof."""
        remarked = replace(self.remarked(remark), certain=min(self.certain, certain))
        if certain < min(enough, self.certain):
            return replace(remarked, certainty="agreement", bound=None)
        return remarked

    def solution(self, digits: int, attitude: bool) -> Solution:
        """Return the solution for a user who requested so many digits."""
        matrix = square(self.blocks["attitude"]) if attitude else None
        evidence = self.evidence
        if self.certain < digits:
            evidence += f": fewer than the {digits} asked for, so trust only the certain ones"
        return Solution(
            self.t, self.blocks["x"], self.blocks["mu"], self.blocks["v"], matrix,
            min(digits, self.certain), self.method, evidence, self.certainty, self.bound,
        )  # fmt: skip


def square(entries: list[Any]) -> Any:
    """Return the N x N mpmath matrix with these entries, row by row."""
    import mpmath

    size = math.isqrt(len(entries))
    return mpmath.matrix([entries[i * size : (i + 1) * size] for i in range(size)])
