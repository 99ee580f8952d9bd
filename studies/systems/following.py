"""A long run in blocks of rows: its energy and momenta, and a few of its states."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from discmech.integrators.errors import BadInput

from .quantities import Part, energies, momentum, step_round_off, sum_round_off, value_round_off

MOST_ROWS = 1_000
STATES = 3  # number of states that are kept, and tested for Ω
LOOKS = 8  # number of rows at which a step's round-off is computed
BLOCK = 2**18  # largest number of sites of the rows in memory, or of one row


@dataclass
class LongRun:
    """The parts of a run that are kept.

    t and energy (r,), and size, the largest sum of the energy's absolute terms. momenta by name.
    states: some (t, x, μ), including the first and the last. every: steps from row to row.
    """

    t: np.ndarray
    energy: np.ndarray
    size: float
    momenta: dict[str, Momentum]
    states: list[tuple[float, np.ndarray, np.ndarray]]
    every: int


def followed(scheme: Any, flow: Any, steps: int, parts: Mapping[str, Part]) -> LongRun:
    """Return a run of so many steps, its energy, and momenta that are given by their parts.

    Only one block of rows is in memory at once, beside the states that are kept. Raises `BadInput`
    for a start without an energy: no later value could be held against it.
    """
    every, sites = max(1, steps // MOST_ROWS), scheme.lattice.sites
    looks, kept = (_spread(steps // every + 1, some) for some in (LOOKS, STATES))
    times, H, size, first = [], [], 0.0, 0
    sums = {name: Momentum(sites) for name in parts}
    states: list[tuple[float, np.ndarray, np.ndarray]] = []
    whole = scheme.lattice.has_contact  # of which no blocks are made
    for block in ([flow.trajectory(steps, every)] if whole else
                  flow.blocks(steps, every, size=max(1, BLOCK // sites))):  # fmt: skip
        with np.errstate(all="ignore"):  # a value that is not finite is told below, or judged
            values, most = energies(scheme, block)
        if not first and not np.isfinite(values[0]):
            raise BadInput(
                f"{scheme.lattice.name}: its energy is no finite real number at x0, v0; begin "
                "elsewhere, or write on_site and on_bond with functions that are real there."
            )
        times.append(block.t)
        H.append(values)
        size = max(size, most)
        inside = range(first, first + len(block.t))
        some = [k - first for k in looks if k in inside]
        for name, part in parts.items():
            sums[name].add(scheme, part, block, some)
        states += [(float(block.t[k - first]), block.x[k - first].copy(),
                    block.mu[k - first].copy()) for k in kept if k in inside]  # fmt: skip
        first += len(block.t)
    return LongRun(np.concatenate(times), np.concatenate(H), size, sums, states, every)


def _spread(count: int, some: int) -> list[int]:
    """Return evenly spaced row numbers, including the first and the last."""
    return sorted(set(np.linspace(0, count - 1, some).astype(int).tolist()))


@dataclass
class Momentum:
    """A momentum along a run: its values, their absolute terms, and the round-off of a step.

    of_value: the round-off of a site's terms, over their size.
    """

    sites: int
    values: list[np.ndarray] = field(default_factory=list)
    terms: float = 0.0
    of_step: float = 0.0
    of_value: float = 0.0

    def add(self, scheme: Any, part: Part, block: Any, some: list[int]) -> None:
        """Add rows of a run; the round-off of a step is computed at some of them."""
        values, terms = momentum(scheme, part, block.x, block.mu)
        self.values.append(values)
        self.terms = max(self.terms, float(terms.max()))
        if some:
            rows = (block.x[some], block.mu[some], float(block.step), block.multipliers[some])
            self.of_step = max(self.of_step, step_round_off(scheme, part, *rows))
            own = value_round_off(scheme, part, block.x[some[0]], block.mu[some[0]])
            self.of_value = max(self.of_value, own)

    @property
    def drifts(self) -> np.ndarray:
        """The largest change since the start per row, (r,), over the absolute terms."""
        values = np.concatenate(self.values, axis=1)
        return np.asarray(abs(values - values[:, :1]).max(axis=0) / (self.terms or 1.0))

    @property
    def units(self) -> tuple[float, float]:
        """The effects of round-off over the same terms, in ε: (in a step, in a value).

        In a step each site is rounded once (times √3, for a relative rounding has ε/√3 in the mean
        square).
        """
        size = self.terms or 1.0
        return math.sqrt(3) * self.of_step / size, sum_round_off(self.sites) + self.of_value
