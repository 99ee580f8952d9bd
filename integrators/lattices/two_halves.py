"""Steps of a lattice whose sites are solved by themselves, in two halves side by side.

First each half moves its sites, then bonds within each half push, and at last those between both.
What is added to a site is so always added in one order: a run is the same with one core.
It pays where a site is solved for: of 50,000 sites bodies take 45 ns a site and step for 82, the
flying spaghetti 87 for 168, of 5,000 sites 79 for 81 and 118 for 161, since two threads have to
meet twice a step. Springs are explicit: two runs of FPUT at once, of 10⁶ sites, take 0.85 for 0.57.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any

import numpy as np

from ..compiler import CORRECTIONS, MOST, OK, PLACE, cores
from .sparse_steps import RUN

LEAST = 4096  # sites, from which on no lattice that was measured becomes slower


class TwoHalves:
    """The steps of a run, whose arguments `advance` takes (`lattice_driver`)."""

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
        """So many: (steps done, status)."""
        for done in range(steps):
            status = self._both(self.own[0], self.own[1])
            if status != OK:
                return done, status
            self._both(self.within[0], self.within[1])
            self._part(self.within[2], self.totals)
        return steps, OK

    def _part(self, part: tuple[Any, ...], totals: np.ndarray) -> int:
        return self.advance(RUN, 1, *self.arrays, *part, totals)[1]

    def _both(self, one: tuple[Any, ...], other: tuple[Any, ...]) -> int:
        """The status of both parts, done side by side."""
        self.others[[CORRECTIONS, MOST]] = 0
        second = self.second
        beside = None if second is None else second.submit(self._part, other, self.others)
        status = self._part(one, self.totals)
        of_other = self._part(other, self.others) if beside is None else beside.result()
        self.totals[CORRECTIONS] += self.others[CORRECTIONS]
        self.totals[MOST] = max(self.totals[MOST], self.others[MOST])
        if status == OK and of_other != OK:
            self.totals[PLACE] = self.others[PLACE]
        return status if status != OK else of_other


@cache
def _second() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(1)


def parted(segments: np.ndarray, cut: int) -> list[list[list[int]]]:
    """Segments of bonds (`lattice_run.segments_of`) below the cut, from it on, and across it."""
    found: list[list[list[int]]] = [[], [], []]
    for a, b, length, first in segments.tolist():
        below, within = (min(max(cut - end, 0), length) for end in (max(a, b), min(a, b)))
        for k, start, stop in ((0, 0, below), (2, below, within), (1, within, length)):
            if start < stop:
                found[k].append([a + start, b + start, stop - start, first + start])
    return found
