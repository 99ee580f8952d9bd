"""Short runs from a flow's own start: begun with nothing left to be checked or looked up."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..bisections import EdgePolicy
from ..compiler import Run
from .initial_state import Start
from .run import SHORT, Trajectory, rows_of

KEPT = 64  # prepared runs of a flow


class PreparedRun:
    """A run whose arrays stay where they are: a call copies its beginning and the rows it made."""

    def __init__(self, edge: EdgePolicy, start: Start, steps: int, every: int) -> None:
        machine: Any = edge.machine if edge.stages is None else edge.stages
        lead = machine.lead(start.x, start.mu, machine.c, start.guess)
        self.edge, self.run = edge, machine.buffers(lead, steps, every)
        edge.begin(self.run)
        self.block, self.t0 = self.run.totals.base, start.t0
        self.state, self.totals = self.run.state.copy(), self.run.totals.copy()
        self.function = machine.kernels.advance.function
        state, c, rows = machine.placed(self.run)
        self.head = state, c, machine.kinds_place
        self.rows, self.substeps, self.out = (
            rows,
            len(machine.kinds),
            machine.kernels.advance.pair(),
        )

    def __call__(self) -> Trajectory | None:
        """The rows; None where a step was not solved."""
        run, out = self.run, self.out
        run.state[:], run.totals[:] = self.state, self.totals
        steps, every = run.steps, run.every
        if steps:
            self.function(*self.head, self.substeps, 0, steps, every, *self.rows, out)
            if out[1]:
                return None
        self.function(*self.head, 1, steps, steps + 1, every, *self.rows, out)  # the last row's u
        if out[1]:
            return None
        block, at = self.block.copy(), len(self.totals)
        parts = []
        for column in (run.xs, run.us, run.mus):
            end = at + column.size
            parts.append(block[at:end].reshape(column.shape))
            at = end
        counts = run.counts.copy()
        none = np.zeros(len(counts), dtype=np.int64)
        x, u, mu = parts
        made = Run(run.state, run.c, steps, every, x, u, mu, counts, run.totals, none, steps)
        return rows_of(self.edge, made, len(counts), self.t0)


class PreparedRuns:
    """The prepared runs of a flow, by (steps, every)."""

    def __init__(self) -> None:
        self._waiting: dict[tuple[int, int], list[PreparedRun]] = {}

    def run(self, flow: Any, steps: int, every: int) -> Trajectory | None:
        """The run from the own start; None where it is long, not of machine code, or fails."""
        if steps // every >= SHORT:
            return None
        waiting = self._waiting.get((steps, every))
        if waiting is None:
            if len(self._waiting) >= KEPT:
                self._waiting.clear()
            waiting = self._waiting[steps, every] = list(_prepared(flow, steps, every))
        try:
            ready = waiting.pop()
        except IndexError:  # there is none, or another thread is at work with it
            return None
        made = ready()
        waiting.append(ready)
        return made


def _prepared(flow: Any, steps: int, every: int) -> Iterator[PreparedRun]:
    with flow.numbers.working():
        edge, start = flow.edge, flow.starting.own
        machine = edge.machine if edge.stages is None else edge.stages
        if not start.translate and hasattr(machine.kernels.advance, "function"):
            yield PreparedRun(edge, start, steps, every)
