"""Timing many runs beside each other: interleaved rounds, medians with quartiles, outliers flagged.

Processor time of this process is measured, which on a quiet machine is the time that passes and on
a busy one does not count the others. What is left of them falls on all runs alike, so ratios are
worth more than the times themselves. Nothing is judged by time.
"""

from __future__ import annotations

import gc
import math
import random
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

LEAST, MOST = 5, 31  # rounds
SHORTEST = 1e-3  # seconds: a shorter run is repeated within a sample, against noise and the clock
KNOWN = 0.03  # a median is known when its interval is this narrow, relatively


@dataclass(frozen=True)
class Timing:
    """Seconds of one run: median, quartiles, number of samples and of outliers among them.

    An outlier lies beyond three interquartile ranges above the upper quartile (or below the lower
    one); it is counted, and kept in the median.
    """

    median: float
    low: float
    high: float
    samples: int
    outliers: int

    @classmethod
    def of(cls, seconds: Sequence[float]) -> Timing:
        """From samples."""
        low, median, high = (float(q) for q in np.percentile(seconds, (25, 50, 75)))
        reach = 3 * (high - low)
        outliers = sum(not low - reach <= s <= high + reach for s in seconds)
        return cls(median, low, high, len(seconds), outliers)

    @property
    def known(self) -> bool:
        """Whether the interval of the median, 1.58 IQR/√n (McGill, Tukey, Larsen), is narrow."""
        return 1.58 * (self.high - self.low) <= KNOWN * self.median * math.sqrt(self.samples)


def race(
    runs: Sequence[Callable[[], object]],
    budget: float,
    clock: Callable[[], float] = time.process_time,
) -> list[Timing]:
    """Time the runs in rounds, in an order that changes from round to round.

    Each takes part in `LEAST` rounds at least; then those whose median is not yet known go on
    among themselves, up to `MOST` rounds and until `budget` seconds are spent.
    """
    chance = random.Random("discmech")
    samples: list[list[float]] = [[] for _ in runs]
    collecting, begun = gc.isenabled(), clock()
    gc.disable()
    try:
        inner = [_repeats(run, clock) for run in runs]
        order = list(range(len(runs)))
        for done in range(1, MOST + 1):
            chance.shuffle(order)
            for k in order:
                start = clock()
                for _ in range(inner[k]):
                    runs[k]()
                samples[k].append((clock() - start) / inner[k])
            if done >= LEAST:
                order = [k for k in order if not Timing.of(samples[k]).known]
                if clock() - begun > budget:
                    break
    finally:
        if collecting:
            gc.enable()
    return [Timing.of(s) for s in samples]


def _repeats(run: Callable[[], object], clock: Callable[[], float]) -> int:
    """How often a run is repeated within one sample."""
    start = clock()
    run()
    return max(1, min(1000, math.ceil(SHORTEST / max(clock() - start, 1e-9))))
