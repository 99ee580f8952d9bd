"""A long run, seen some rows at a time: its energy and momenta, and a few of its states."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..momentum.measuring import FARTHEST
from .quantities import Part, energies, momentum, step_round_off, sum_round_off, value_round_off

MOST_ROWS = 1_000
STATES = 3  # that are kept, and tested for Ω
LOOKS = 8  # rows at which a step's round-off is asked for
BLOCK = 2**18  # sites of the rows that are held at once, or of one row
EPS = 2.0**-53


@dataclass
class LongRun:
    """What is kept of a run.

    t and errors (r,): of the energy, over the largest sum of its absolute terms. momenta: name →
    (drift, what round-off may leave), both over that sum. states: some (x, μ), first and last too.
    """

    t: np.ndarray
    errors: np.ndarray
    momenta: dict[str, tuple[float, float]]
    states: list[tuple[np.ndarray, np.ndarray]]


def followed(scheme: Any, flow: Any, steps: int, parts: Mapping[str, Part]) -> LongRun:
    """A run of so many steps, its energy, and momenta that are given by their parts.

    No more than a block of rows is held at once, beside the states that are kept.
    """
    every, sites = max(1, steps // MOST_ROWS), scheme.lattice.sites
    looks, kept = (_spread(steps // every + 1, some) for some in (LOOKS, STATES))
    times, H, size, first = [], [], 0.0, 0
    sums = {name: Momentum() for name in parts}
    states: list[tuple[np.ndarray, np.ndarray]] = []
    for block in flow.blocks(steps, every, size=max(1, BLOCK // sites)):
        values, most = energies(scheme, block)
        times.append(block.t)
        H.append(values)
        size = max(size, most)
        inside = range(first, first + len(block.t))
        some = [k - first for k in looks if k in inside]
        for name, part in parts.items():
            sums[name].add(scheme, part, block, some)
        states += [(block.x[k - first].copy(), block.mu[k - first].copy()) for k in kept
                   if k in inside]  # fmt: skip
        first += len(block.t)
    energy = np.concatenate(H)
    walked = steps * max(1, len(scheme.substeps))
    return LongRun(np.concatenate(times), (energy - energy[0]) / (size or 1),
                   {name: s.drift(walked, sites) for name, s in sums.items()}, states)  # fmt: skip


def _spread(count: int, some: int) -> list[int]:
    """Numbers of rows, the first and the last too."""
    return sorted(set(np.linspace(0, count - 1, some).astype(int).tolist()))


@dataclass
class Momentum:
    """A momentum along a run: its values, their absolute terms, and the round-off of a step.

    of_value: of a site's terms, over their size.
    """

    values: list[np.ndarray] = field(default_factory=list)
    terms: float = 0.0
    of_step: float = 0.0
    of_value: float = 0.0

    def add(self, scheme: Any, part: Part, block: Any, some: list[int]) -> None:
        """Rows of a run; the round-off of a step is asked for at some of them."""
        values, terms = momentum(scheme, part, block.x, block.mu)
        self.values.append(values)
        self.terms = max(self.terms, float(terms.max()))
        if some:
            rows = (block.x[some], block.mu[some], float(block.step), block.multipliers[some])
            self.of_step = max(self.of_step, step_round_off(scheme, part, *rows))
            own = value_round_off(scheme, part, block.x[some[0]], block.mu[some[0]])
            self.of_value = max(self.of_value, own)

    def drift(self, steps: int, sites: int) -> tuple[float, float]:
        """(the most that it changes, what round-off may leave), over its absolute terms."""
        values, size = np.concatenate(self.values, axis=1), self.terms or 1.0
        own = 2 * (sum_round_off(sites) + self.of_value) * size  # of the first and of this row
        walk = FARTHEST * math.sqrt(steps) * self.of_step
        return float(abs(values - values[:, :1]).max()) / size, EPS * (walk + own) / size
