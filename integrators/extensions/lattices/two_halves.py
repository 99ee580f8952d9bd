"""Steps of a lattice whose sites are solved separately, in two halves side by side.

First each half moves its sites, then the bonds within each half act, and at last those between the
halves. So the forces on a site are always added in the same order, and a run with one core gives
the same numbers. It pays if a site needs a solver: with 50,000 sites, bodies take 45 ns per site
and step instead of 82, the flying spaghetti 87 instead of 168; with 5,000 sites 79 instead of 81
and 118 instead of 161, since two threads must meet twice a step. Springs are explicit: two
simultaneous runs of FPUT with 10⁶ sites take 0.85 instead of 0.57.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any, TypeAlias

import numpy as np

from ...compiler import Entry, Status, cores
from .sparse_steps import RUN

#: (ranges of sites, their number, segments of bonds, their number)
Part: TypeAlias = tuple[np.ndarray, int, np.ndarray, int]

LEAST = 4096  # no measured lattice with at least so many sites becomes slower


class TwoHalves:
    """The steps of a run, from the arguments that `advance` takes (`lattice_driver`)."""

    def __init__(self, advance: Callable[..., tuple[int, int]], arguments: tuple[Any, ...]) -> None:
        *self.arrays, ranges, _, segments, _, self.totals = arguments
        self.advance, cut = advance, len(arguments[0]) // 2
        none = ranges, 0, segments, 0
        sites = [np.clip(ranges, *ends) for ends in ((0, cut), (cut, len(arguments[0])))]
        sites = [np.ascontiguousarray(rows[rows[:, 0] < rows[:, 1]]) for rows in sites]
        bonds = [np.array(rows, dtype=np.int64) for rows in parted(segments, cut)]
        self.own = [(rows, len(rows), *none[2:]) if len(rows) else none for rows in sites]
        self.within = [(*none[:2], rows, len(rows)) if len(rows) else none for rows in bonds]
        self.others = np.zeros_like(self.totals)
        self.second = _second() if cores() > 1 else None

    def steps(self, steps: int) -> tuple[int, int]:
        """Take so many steps: return (steps done, status)."""
        for done in range(steps):
            status = self._both(self.own[0], self.own[1])
            if status != Status.OK:
                return done, status
            self._both(self.within[0], self.within[1])
            self._part(self.within[2], self.totals)
        return steps, Status.OK

    def _part(self, part: Part, totals: np.ndarray) -> int:
        return self.advance(RUN, 1, *self.arrays, *part, totals)[1]

    def _both(self, one: Part, other: Part) -> int:
        """Do both parts side by side; return their common status."""
        self.others[[Entry.CORRECTIONS, Entry.MOST]] = 0
        second = self.second
        beside = None if second is None else second.submit(self._part, other, self.others)
        status = self._part(one, self.totals)
        of_other = self._part(other, self.others) if beside is None else beside.result()
        self.totals[Entry.CORRECTIONS] += self.others[Entry.CORRECTIONS]
        self.totals[Entry.MOST] = max(self.totals[Entry.MOST], self.others[Entry.MOST])
        if status == Status.OK and of_other != Status.OK:
            self.totals[Entry.PLACE] = self.others[Entry.PLACE]
        return status if status != Status.OK else of_other


@cache
def _second() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(1)


def parted(segments: np.ndarray, cut: int) -> list[list[list[int]]]:
    """Return the segments of bonds below the cut, above it, and across it.

    Segments are those of `lattice_run.segments_of`.
    """
    parts: list[list[list[int]]] = [[], [], []]
    for a, b, length, first in segments.tolist():
        below, within = (min(max(cut - end, 0), length) for end in (max(a, b), min(a, b)))
        for k, start, stop in ((0, 0, below), (2, below, within), (1, within, length)):
            if start < stop:
                parts[k].append([a + start, b + start, stop - start, first + start])
    return parts
