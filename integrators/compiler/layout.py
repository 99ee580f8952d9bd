"""Where things stand in the arrays that the driver works on, and what its status codes mean."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

#: status of a run: all is well; Newton does not converge; a correction is no number; a step is at
#: the edge of its chart; the number that tells branches apart jumped
OK, NOT_CONVERGED, SINGULAR, EDGE, STRAYED = range(5)
#: entries of `totals`: corrections in all, most in a step, size of the last one; the largest size
#: (`System.extents`), the size that ends a run, the last branch number (HUGE: none yet), the
#: largest change of it
CORRECTIONS, MOST, LAST_SIZE, FARTHEST, REACH, BRANCH, SLACK = range(7)
TOTALS = 7
#: and behind them, of the step with most sweeps: the ratio of two changes, so many sweeps apart
CONTRACTION, SWEEPS, ENTRIES = 7, 8, 9
#: a lattice's entries behind the size of the last correction: the site whose step was not found;
#: Newton's memory, which all sites share: κ, the scale, the age, the degree of extrapolation; the
#: size of the last correction without multipliers
PLACE, KAPPA, SCALE, AGE, DEGREE, MOVED, LATTICE_ENTRIES = range(3, 10)
INNER = 3  # sweeps that bring a curve into the next chart
PAST = 5  # solutions from which Newton's start is extrapolated


@dataclass(frozen=True)
class Layout:
    """The state: x, μ, what their sums lost, reused functions of x, then each substep's memory.

    solved: unknowns of a step; reused: functions of x handed on; width: coefficients a substep
    has at most; more: unknowns behind u that rows hold; iterated: whether some step is solved by
    Newton, which needs a memory: the past solutions, latest first, the order of extrapolation, the
    age, κ and the scale (`driver.newton`).
    """

    n: int
    m: int
    solved: int
    reused: int
    width: int
    iterated: bool
    more: int = 0

    @property
    def shown(self) -> int:
        """Unknowns that rows hold: u, and the multipliers behind it."""
        return self.m + self.more

    @cached_property
    def parts(self) -> tuple[slice, ...]:
        """x, μ, what the sums of x and of μ lost to rounding, functions of x of the step before."""
        ends = [*accumulate((0, self.n, self.m, self.n, self.m, self.reused))]
        return tuple(map(slice, ends, ends[1:]))

    @property
    def memory(self) -> int:
        """Where the first substep's memory begins."""
        return 2 * (self.n + self.m) + self.reused

    @property
    def row(self) -> int:
        """Entries of one substep's memory."""
        return PAST * self.solved + 4 if self.iterated else 0


@dataclass(frozen=True)
class StageLayout(Layout):
    """The state of collocation: its memory is the age, and u, π₀ − μ, ξ and μ at
    the nodes of the last step.

    count: stages; they take up to seven more places, whatever a vector of this machine holds.
    """

    count: int = 1

    @property
    def lanes(self) -> int:
        """Places of the stages of one component."""
        return self.count + 7

    @property
    def row(self) -> int:
        return 1 + 2 * self.m + 2 * self.m * self.lanes
