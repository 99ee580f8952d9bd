"""Short runs, begun with nothing left to be checked or looked up."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..bisections import EdgePolicy
from ..compiler import Run
from ..numbers import Vector
from .initial_state import Start
from .run import SHORT, Trajectory, counted, rows_of

KEPT = 64  # prepared runs of a flow


class PreparedRun:
    """A run whose arrays stay where they are: a call copies its beginning and the rows it made.

    What no call changes (times, step, solver) is taken from the rows of a first run.
    """

    def __init__(self, edge: EdgePolicy, start: Start, steps: int, every: int) -> None:
        machine: Any = edge.machine if edge.stages is None else edge.stages
        self.lead = partial(machine.lead, c=machine.c)
        run: Run = machine.buffers(self.lead(start.x, start.mu, guess=start.guess), steps, every)
        edge.begin(run)
        self.start, self.steps, self.state, self.totals = start, steps, run.state, run.totals
        self.block, self.counts = np.asarray(run.totals.base), run.counts
        self.out = machine.kernels.advance.pair()
        self.beginning = run.state.copy(), run.totals.copy()
        state, c, rows = machine.placed(run)
        call = partial(machine.kernels.advance.function, state, c, machine.kinds_place)
        substeps = len(machine.kinds)
        # the row at the end gets its u, for which the first substep of one more step is enough
        whole = substeps == 1
        self.parts = [] if whole or not steps else [partial(call, substeps, 0, steps, every)]
        self.parts.append(partial(call, 1, 0 if whole else steps, steps + 1, every))
        self.parts = [partial(part, *rows, self.out) for part in self.parts]
        run.index = steps
        self.same = dict(vars(rows_of(edge, run, len(run.counts), start.t0)))
        self.length, self.places = len(run.totals), list[tuple[slice, tuple[int, ...]]]()
        at = self.length
        for column in (run.xs, run.us, run.mus):
            self.places.append((slice(at, at + column.size), column.shape))
            at += column.size
        self.n, self.m = self.same["x"].shape[1], self.same["u"].shape[1]
        self.shorter = 2 / edge.context.parts[0].h

    def __call__(self, start: Start) -> Trajectory | None:
        """The rows from a start at time 0; None where a step was not solved."""
        self.state[:], self.totals[:] = self.beginning
        if start is not self.start:
            self.state[:], _ = self.lead(start.x, start.mu, guess=start.guess)
        for part in self.parts:
            part()
            if self.out[1]:
                return None
        made = object.__new__(_Unread)
        vars(made)["_columns"] = partial(self.columns, self.block.copy(), self.counts.copy())
        return made

    def columns(self, block: Vector, counts: Vector) -> dict[str, Any]:
        """The fields of a trajectory, from copies of what a call wrote."""
        x, u, mu = (block[part].reshape(shape) for part, shape in self.places)
        return {
            **self.same,
            **counted(block[: self.length].tolist(), self.steps),
            "t": self.same["t"].copy(),
            "base": x,
            "x": x[:, : self.n],
            "u": u[:, : self.m],
            "mu": mu,
            "iterations": counts,
            "translates": self.same["translates"].copy(),
            "multipliers": u[:, self.m :] * self.shorter,
        }


class _Unread(Trajectory):
    """A trajectory of which nobody has asked for anything; with the first question it is plain."""

    def __init__(self) -> None:
        raise AssertionError("made by `PreparedRun` alone")

    def __getattr__(self, name: str) -> Any:
        fields = vars(self)
        if (columns := fields.get("_columns")) is not None:
            fields.update(columns())
            fields.pop("_columns", None)
        object.__setattr__(self, "__class__", Trajectory)
        return getattr(self, name)

    def __reduce_ex__(self, protocol: Any) -> Any:
        _ = self.step
        return self.__reduce_ex__(protocol)  # of what is a plain trajectory now


class PreparedRuns:
    """The prepared runs of a flow, by (steps, every)."""

    def __init__(self) -> None:
        self._waiting: dict[tuple[int, int], list[PreparedRun]] = {}

    def __contains__(self, counts: tuple[int, int]) -> bool:
        return counts in self._waiting

    def run(self, steps: int, every: int, start: Start) -> Trajectory | None:
        """The run from a start; None where it is not prepared, or fails."""
        waiting = self._waiting.get((steps, every))
        if not waiting or start.translate or start.t0:
            return None
        try:
            ready = waiting.pop()
        except IndexError:  # another thread is at work with it
            return None
        made = ready(start)
        waiting.append(ready)
        return made

    def prepare(self, edge: EdgePolicy, start: Start, steps: int, every: int) -> None:
        """Let later runs begin at once; those that are long, or not of machine code, do not."""
        machine: Any = edge.machine if edge.stages is None else edge.stages
        mapped = edge.context.one_step  # its u is computed from its rows
        coded = not mapped and hasattr(machine.kernels.advance, "function")
        if not coded or steps // every >= SHORT or start.translate or start.t0:
            return
        if len(self._waiting) >= KEPT:
            self._waiting.clear()
        waiting = self._waiting.setdefault((steps, every), [])
        if not waiting:
            waiting.append(PreparedRun(edge, start, steps, every))
