"""The parts of a motion in which a rule may do something else than elsewhere.

A fault in a narrow part of the motion is missed by any few places. But a run of many short steps
goes through every part, and its rows are smooth but where the rule is not: differences of a high
order, over ever more rows, make them small and leave what a narrow part does. So a scan judges
nothing. It names the times at which differences stand out, and single steps from there are judged
as those from all other places. A second run, of longer steps, shows what is of a higher power of
the step.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import comb
from typing import Any

import numpy as np

from discmech.integrators import Scheme
from discmech.integrators.errors import DiscmechError
from discmech.integrators.numbers import Matrix, Vector

ORDER = 8  # of the differences: where a run has so many rows a motion is smooth to round-off
#: rows of a run, divided by the number of its unknowns, and the least and largest distance of rows
ROWS, LEAST, WIDEST = 2**15, 2**11, 2**8
LONGER = 16  # times as long steps has the second run
NEARBY = 64  # differences on either side, whose median is what the motion itself does there
SHORT = 8  # such a part of the run is short against the motion
#: times the differences nearby: the motion's own grow by less over `NEARBY` of them, or they are
#: among the largest, whose places cost some steps and deny nothing
STANDS_OUT = 100
#: round-offs of a difference: Σ binomials² of them in the square, and a walk between its rows
ROUND_OFFS = 8
FEWEST, MOST = 3, 16  # places that are looked at, fewer of a scheme with costly steps
OF_PART = 16  # a long run takes seconds, this a part of one


@dataclass(frozen=True)
class Peak:
    """A difference of rows of a run that stands out, so many times, and where in the motion it is.

    reach: the farthest that a state from which it is made lies from its own.
    """

    times: float
    time: Fraction
    state: Vector
    reach: float

    def is_beside(self, other: Peak) -> bool:
        """True if it is made of other states. A motion that comes back shows a part again."""
        return bool(np.abs(self.state - other.state).max() > self.reach)


@lru_cache(maxsize=256)
def times_that_stand_out(scheme: Scheme) -> tuple[list[Fraction], str]:
    """Return (the times at which a run of short steps is least smooth, why no run was made or "").

    No two are of the same part of the motion: one that is narrow, but rightly followed, would else
    hide a fault in another by coming back. It has at most a part (`OF_PART`) of the steps of a
    long run.
    """
    steps = steps_of(scheme)
    most = max(FEWEST, MOST // costs_of(scheme)) if scheme.rule.is_formula else FEWEST
    all_peaks, why = list[Peak](), ""
    for count in (steps, steps // LONGER):
        try:
            all_peaks += _of_run(scheme, count)
        except DiscmechError as failure:
            why = why or f"of {count} steps: {' '.join(str(failure).split())}"
    return [peak.time for peak in highest(all_peaks, most)], why


def highest(peaks: Iterable[Peak], most: int) -> list[Peak]:
    """Return so many peaks that stand out most, no two of the same part of the motion."""
    chosen: list[Peak] = []
    for peak in sorted(peaks, key=lambda peak: -peak.times):
        if len(chosen) < most and all(peak.is_beside(other) for other in chosen):
            chosen.append(peak)
    return chosen


def costs_of(scheme: Scheme) -> int:
    """Return how dear a step of a scheme is, by its unknowns; 1 for a pair of numbers."""
    return max(1, (len(scheme.s.x) + len(scheme.s.u)) * (1 + len(scheme.s.stages)) // 2)


def steps_of(scheme: Scheme) -> int:
    """Return the number of the short steps of a run through the scene's duration."""
    return min(max(LEAST, ROWS // costs_of(scheme)), scheme.rule.long_run // OF_PART)


@lru_cache(maxsize=8)
def run_of(scheme: Scheme, steps: int) -> Any:
    """Return a run of so many steps through the scene's duration, in doubles."""
    return scheme.flow(Fraction(scheme.scene.duration) / steps, 16).trajectory(steps)


def _of_run(scheme: Scheme, steps: int) -> Iterator[Peak]:
    """Yield the differences that stand out in a run of so many steps, over ever more rows."""
    if steps < (ORDER + 2 * NEARBY):
        return
    run = run_of(scheme, steps)
    rows = np.hstack([np.asarray(part, dtype=float) for part in (run.base, run.mu)])
    yield from peaks_of(rows, run.step, scheme.rule.unit(16))


def peaks_of(rows: Matrix, step: Fraction, unit: float) -> Iterator[Peak]:
    """Yield the differences that stand out in rows of a run, (r, k), over ever more of them."""
    if not rows.any() or not np.isfinite(rows).all():
        return
    sizes = np.abs(rows).max(axis=0)
    rows = rows / np.where(sizes > 0, sizes, 1)
    apart = 1
    while apart <= WIDEST and (ORDER + 2 * NEARBY) * apart < len(rows):
        for times, row in peaks(rows, apart, unit):
            made_of = rows[max(0, row - ORDER * apart) : row + ORDER * apart + 1]
            reach = float(np.abs(made_of - rows[row]).max())
            yield Peak(times, row * step, rows[row], reach)
        apart *= 2


def peaks(rows: Matrix, apart: int, unit: float) -> Iterator[tuple[float, int]]:
    """Yield (how far it stands out, its row) of differences over rows so far apart.

    Beyond both ends the median takes the mirrored differences: the last one again and again would
    be the usual one where it is itself the fault. Where it is taken over so much of the motion that
    this may grow as much itself, as to a pericentre at the start, the last one is repeated.
    """
    from scipy.ndimage import maximum_filter1d, median_filter

    signs = [(-1) ** j * comb(ORDER, j) for j in range(ORDER + 1)]
    count = len(rows) - ORDER * apart
    of: Vector = np.abs(
        sum(c * rows[j * apart : j * apart + count] for j, c in enumerate(signs))
    ).max(axis=1)
    noise = ROUND_OFFS * unit * np.sqrt(comb(2 * ORDER, ORDER) * (1 + apart))
    among = maximum_filter1d(of, ORDER * apart)[:: ORDER * apart // 2]
    short = NEARBY * (ORDER * apart // 2) * SHORT <= len(rows)
    usual = median_filter(among, NEARBY, mode="mirror" if short else "nearest")
    score = among / (STANDS_OUT * usual + noise)
    for k in np.flatnonzero((score > 1) & (score == maximum_filter1d(score, 3))):
        near = int(k) * (ORDER * apart // 2)
        lo = max(0, near - ORDER * apart // 2)
        peak = lo + int(of[lo : near + ORDER * apart // 2 + 1].argmax())
        yield float(score[k]), peak + ORDER * apart // 2
