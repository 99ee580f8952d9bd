"""The layout of the arrays that the drivers work on, and their status."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from itertools import accumulate


class Status(IntEnum):
    """How a run ended: it went on; Newton's method did not converge; a correction is NaN or
    infinite; a step is at the edge of its chart; the number that tells branches apart jumped;
    correcting a lattice site by site does not solve a substep.
    """

    OK, NOT_CONVERGED, SINGULAR, EDGE, STRAYED, GAVE_WAY = range(6)


class Entry(IntEnum):
    """The entries of `totals`, the counters and the limits of a run.

    CORRECTIONS, MOST, LAST_SIZE: corrections in all, most in a step, size of the last one.
    FARTHEST, REACH: the largest size (`System.extents`), and the size that ends a run; BRANCH,
    SLACK: the last branch number (HUGE before the first step), and its largest allowed change.
    CONTRACTION, SWEEPS: of the step with most sweeps, the ratio of two changes, and the sweeps
    between them.
    Of a lattice, PLACE: the site whose step was not found; KAPPA, SCALE, AGE, DEGREE: the memory of
    Newton's method, which all sites share: κ, the scale, the age, the degree of extrapolation;
    MOVED: the size of the last correction without multipliers; STEPS: the steps done, where the
    time is explicit.
    """

    CORRECTIONS, MOST, LAST_SIZE = range(3)
    FARTHEST, REACH, BRANCH, SLACK, CONTRACTION, SWEEPS = range(3, 9)
    PLACE, KAPPA, SCALE, AGE, DEGREE, MOVED, STEPS = range(9, 16)


#: machine code returns an index and a status as one number, index·STATUSES + status; any number
#: above those of `Status` would do, and an index may be as large as 2⁵⁴
STATUSES = 512
INNER = 3  # number of sweeps that bring a curve into the next chart
PAST = 5  # number of past solutions from which Newton's start is extrapolated


@dataclass(frozen=True)
class Layout:
    """The state: x, μ, the rounding errors of their sums, reused functions of x, and memories.

    solved: unknowns of a step; reused: functions of x handed on to the next step; width: largest
    number of coefficients of a substep; multipliers: unknowns after u that rows hold; iterated:
    True if some step is solved by Newton's method. Then each substep has a memory: past solutions,
    latest first, the order of extrapolation, the age, κ and the scale (`newton_iteration.newton`).
    """

    n: int
    m: int
    solved: int
    reused: int
    width: int
    iterated: bool
    multipliers: int = 0

    @property
    def row_width(self) -> int:
        """The number of unknowns in a written row: u, and the multipliers after it."""
        return self.m + self.multipliers

    @cached_property
    def columns(self) -> int:
        """The numbers of a row: x, what `row_width` counts, and μ."""
        return self.n + self.row_width + self.m

    @cached_property
    def parts(self) -> tuple[slice, ...]:
        """The slices of x, μ, the rounding errors of their sums, and the reused functions of x."""
        ends = [*accumulate((0, self.n, self.m, self.n, self.m, self.reused))]
        return tuple(map(slice, ends, ends[1:]))

    @property
    def memory(self) -> int:
        """The index at which the first substep's memory begins."""
        return 2 * (self.n + self.m) + self.reused

    @property
    def row(self) -> int:
        """The length of one substep's memory."""
        return PAST * self.solved + 4 if self.iterated else 0


@dataclass(frozen=True)
class StageLayout(Layout):
    """The state of collocation: its memory is the age, and u, π₀ − μ, ξ and μ at the last nodes.

    count: number of stages; they take up to seven more places, whatever a vector of this machine
    holds.
    """

    count: int = 1

    @property
    def lanes(self) -> int:
        """The places for the stages of one component."""
        return self.count + 7

    @property
    def row(self) -> int:
        return 1 + 2 * self.m + 2 * self.m * self.lanes
