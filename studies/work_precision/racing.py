"""Timing many runs beside each other: interleaved rounds, medians with quartiles, outliers flagged.

Processor time of this process is measured, which on a quiet machine is the elapsed time and on a
busy one does not count other processes (`core.clocks`). Their remaining effect is the same for all
runs, so ratios are better known than times. Nothing is judged by time.
"""

from __future__ import annotations

import gc
import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..core.clocks import Clock, fine_clock, tick_of

LEAST, MOST = 5, 31  # rounds
SHORTEST = 1e-3  # seconds: a shorter run is repeated within a sample, against noise and the clock
LEAST_CALL = 1e-6  # seconds that a call takes at least, whatever a clock says
#: seconds: before each sample of a shorter run it is called once untimed. The first call after
#: another run finds caches and branch predictors cold and takes 20 to 100 µs more: up to four times
#: as long, and not the same from process to process. For a longer run that is no more than `KNOWN`
WARM = 2.5e-3
#: a median is known when half of the interval that contains it with this confidence is at most this
#: share of it
CONFIDENCE, KNOWN = 0.9, 0.04


@dataclass(frozen=True)
class Timing:
    """Seconds of one run: median, quartiles, number of samples and of outliers among them.

    An outlier lies beyond three interquartile ranges above the upper quartile (or below the lower
    one); it is counted, and kept in the median. The median is `known` when half of its interval
    between order statistics (David, Nagaraja, Order Statistics, 7.1) is at most `KNOWN` of it. That
    assumes no distribution of times, and five samples must all agree: the quartiles of so few are
    too often close by chance.
    """

    median: float
    low: float
    high: float
    samples: int
    outliers: int
    known: bool

    @classmethod
    def of(cls, seconds: Sequence[float]) -> Timing:
        """Return the timing of samples."""
        low, median, high = (float(q) for q in np.percentile(seconds, (25, 50, 75)))
        reach = 3 * (high - low)
        outliers = sum(not low - reach <= s <= high + reach for s in seconds)
        ordered, rank = sorted(seconds), _rank(len(seconds))
        known = rank > 0 and ordered[-rank] - ordered[rank - 1] <= 2 * KNOWN * median
        return cls(median, low, high, len(seconds), outliers, known)


@lru_cache(maxsize=64)
def _rank(samples: int) -> int:
    """Return the largest r with the median between the r-th smallest and r-th largest sample.

    It holds with `CONFIDENCE` for so many samples; 0 if they are too few for any.
    """
    outside, rank = 0.0, 0
    while True:
        outside += 2 * math.comb(samples, rank) / 2**samples
        if outside > 1 - CONFIDENCE:
            return rank
        rank += 1


def race(
    runs: Sequence[Callable[[], object]], budget: float, clock: Clock | None = None
) -> list[Timing]:
    """Time the runs in rounds, in an order that changes from round to round.

    Each takes part in `LEAST` rounds at least; then those whose median is not yet known continue
    among themselves, up to `MOST` rounds and until `budget` seconds are spent. A run that has
    `ready` is told the number of calls before they are timed. By a clock with long ticks a sample
    takes so many of them that one is at most `KNOWN` of it.
    """
    clock = clock or fine_clock()
    tick = tick_of(clock)
    chance = random.Random("discmech")
    samples: list[list[float]] = [[] for _ in runs]
    collecting, begun = gc.isenabled(), clock()
    gc.disable()
    try:
        plans = [_plan(run, clock, tick) for run in runs]
        order = list(range(len(runs)))
        for done in range(1, MOST + 1):
            chance.shuffle(order)
            for k in order:
                warm, repeats = plans[k]
                _ready(runs[k], warm + repeats)
                if warm:
                    runs[k]()
                start = clock()
                for _ in range(repeats):
                    runs[k]()
                samples[k].append((clock() - start) / repeats)
            if done >= LEAST:
                order = [k for k in order if not Timing.of(samples[k]).known]
                if clock() - begun > budget:
                    break
    finally:
        if collecting:
            gc.enable()
    return [Timing.of(s) for s in samples]


def _ready(run: Callable[[], object], calls: int) -> None:
    if (ready := getattr(run, "ready", None)) is not None:
        ready(calls)


def _plan(run: Callable[[], object], clock: Clock, tick: float) -> tuple[bool, int]:
    """Return (True if a run needs an untimed call before a sample, the number of calls within it).

    It is found from the fastest of three calls, or of as many as take a tick: the first is cold,
    and any may be disturbed. For a long run one call is enough.
    """
    fastest = math.inf
    for _ in range(3):
        calls, spent = 0, -1.0
        _ready(run, 1)
        start = clock()
        while spent < tick:
            run()
            calls, spent = calls + 1, clock() - start
        fastest = min(fastest, spent / calls)
        if fastest >= 2 * WARM:
            break
    sample = max(SHORTEST, tick / KNOWN)
    return fastest < WARM, max(1, math.ceil(sample / max(fastest, LEAST_CALL)))
