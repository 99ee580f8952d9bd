"""The clock that measures are timed by: of the processor where that is fine enough."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import cache

Clock = Callable[[], float]
FINE = 4e-5  # seconds: the longest tick that a sample of a millisecond is timed by to 4 %
WAIT = 0.05  # seconds in which a clock's ticks are looked at: three of the longest known


@cache
def fine_clock() -> Clock:
    """Return the clock of this process's processor time; that of elapsed time if its ticks are
    long.

    Windows counts processor time in ticks of 15.6 ms, whatever resolution it reports, so the ticks
    are measured.
    """
    return time.process_time if tick_of(time.process_time) <= FINE else time.perf_counter


def tick_of(clock: Clock) -> float:
    """Return the least seconds by which a clock moves; 0 if it does not move by itself."""
    ends, before, least = time.perf_counter() + WAIT, clock(), math.inf
    while time.perf_counter() < ends:
        if (now := clock()) > before:
            before, least = now, min(least, now - before)
            if least <= FINE:
                break
    return least if least < math.inf else 0.0
