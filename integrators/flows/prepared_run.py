"""Short runs that begin without checks or look-ups."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from ..bisections import EdgePolicy
from ..compiler import Run, address
from ..numbers import Matrix, Vector
from .initial_state import Start
from .run import SHORT, Trajectory, counted, rows_of

KEPT = 64  # prepared runs of a flow
READ_ALONE = ("x", "u", "mu", "base")  # columns that can be read without computing the counters


class PreparedRun:
    """A run with fixed arrays: a call copies its beginning into them and its rows out of them.

    Constants of all calls (times, step, solver) are taken from the rows of a first run.
    """

    def __init__(self, edge: EdgePolicy, start: Start, steps: int, every: int) -> None:
        machine: Any = edge.machine if edge.stages is None else edge.stages
        self.start_at, self.place = (
            partial(f, c=machine.c) for f in (machine.start_at, machine.place)
        )
        run: Run = machine.buffers(
            self.start_at(start.x, start.mu, guess=start.guess), steps, every
        )
        edge.begin(run)
        self.start, self.steps, self.state, self.totals = start, steps, run.state, run.totals
        self.block, self.counts = np.asarray(run.totals.base), run.counts
        self.out = machine.kernels.advance.pair()
        self.beginning = run.state.copy(), run.totals.copy()
        function, substeps = machine.kernels.advance.function, len(machine.kinds)
        # the last row needs its u, for which the first substep of one more step suffices
        whole = substeps == 1
        calls = [] if whole or not steps else [(substeps, 0, steps)]
        calls.append((1, 0 if whole else steps, steps + 1))
        self.parts = []
        for call in calls:
            given = (run.state, run.c, machine.kinds, *call, every, *run.rows)
            kinds = function.argtypes  # arguments of these types need no conversion in each call
            places = (address(e) if isinstance(e, np.ndarray) else e for e in given)
            given = tuple(kind(e) for kind, e in zip(kinds, places, strict=False))
            self.parts.append(partial(function, *given, self.out))
        run.index = steps
        self.same = dict(vars(rows_of(edge, run, len(run.counts), start.t0)))
        self.length, self.places = len(run.totals), list[tuple[slice, tuple[int, ...]]]()
        at = self.length
        for column in (run.xs, run.us, run.mus):
            self.places.append((slice(at, at + column.size), column.shape))
            at += column.size
        # 0·∞ is NaN, so the sum of 0 times finite numbers is 0, and otherwise it is not
        self.zeros = np.zeros(len(self.block))
        self.between = steps % every != 0  # then the end is no row
        self.end = self.state[: machine.layout.parts[1].stop]
        self.n, self.m = self.same["x"].shape[1], self.same["u"].shape[1]
        self.shorter = 2 / edge.context.parts[0].h

    def __call__(self, start: Start) -> Trajectory | None:
        """Return the rows from a start at time 0, or None if a step failed or became non-finite."""
        np.copyto(self.state, self.beginning[0])
        np.copyto(self.totals, self.beginning[1])
        if start.guess is not self.start.guess:
            self.state[:], _ = self.start_at(start.x, start.mu, guess=start.guess)
        elif start is not self.start:
            self.place(self.state, start.x, start.mu)
        for part in self.parts:
            part()
            if self.out[1]:
                return None
        block = self.block.copy()
        if self.zeros.dot(block) != 0 or (self.between and not np.isfinite(self.end).all()):
            return None
        made = object.__new__(_Unread)
        vars(made)["_unread"] = self, block, self.counts.copy()
        return made

    def column(self, name: str, block: Vector) -> Matrix:
        """Return x, base, u, mu or, as "shown", u with the multipliers, from a copy of the rows."""
        part, shape = self.places[0 if name in ("x", "base") else 2 if name == "mu" else 1]
        column = block[part].reshape(shape)
        return (
            column[:, : self.n] if name == "x" else column[:, : self.m] if name == "u" else column
        )

    def columns(self, block: Vector, counts: Vector) -> dict[str, Any]:
        """Return the fields of a trajectory, from copies of the rows."""
        return {
            **self.same,
            **counted(block[: self.length].tolist(), self.steps),
            **{name: self.column(name, block) for name in READ_ALONE},
            "t": self.same["t"].copy(),
            "iterations": counts,
            "translates": self.same["translates"].copy(),
            "multipliers": self.column("shown", block)[:, self.m :] * self.shorter,
        }


class _Unread(Trajectory):
    """A trajectory that computes its counters on first use, and then becomes a plain one."""

    __qualname__ = Trajectory.__qualname__  # the name at the beginning of its repr

    def __init__(self) -> None:
        raise AssertionError("made by `PreparedRun` alone")

    def __getattr__(self, name: str) -> Any:
        fields = vars(self)
        unread = fields.get("_unread")
        if unread is not None and name in READ_ALONE:
            return fields.setdefault(name, unread[0].column(name, unread[1]))
        if unread is not None:
            own = {name: fields[name] for name in READ_ALONE if name in fields}
            fields.update(unread[0].columns(*unread[1:]) | own)
            fields.pop("_unread", None)
        object.__setattr__(self, "__class__", Trajectory)
        return getattr(self, name)

    def __reduce_ex__(self, protocol: Any) -> Any:
        _ = self.step
        return self.__reduce_ex__(protocol)  # now it is a plain trajectory


class PreparedRuns:
    """The prepared runs of a flow, by (steps, every)."""

    def __init__(self) -> None:
        self._waiting: dict[tuple[int, int], list[PreparedRun]] = {}

    def __contains__(self, counts: tuple[int, int]) -> bool:
        return counts in self._waiting

    def run(self, steps: int, every: int, start: Start) -> Trajectory | None:
        """Return the run from a start, or None if it is not prepared or fails."""
        waiting = self._waiting.get((steps, every))
        if not waiting or start.translate or start.t0:
            return None
        try:
            ready = waiting.pop()
        except IndexError:  # another thread is using it
            return None
        made = ready(start)
        waiting.append(ready)
        return made

    def prepare(self, edge: EdgePolicy, start: Start, steps: int, every: int) -> None:
        """Prepare later runs, unless they are long or not in machine code."""
        machine: Any = edge.machine if edge.stages is None else edge.stages
        mapped = edge.context.equations.arrows is None  # its u is computed from its rows
        coded = not mapped and hasattr(machine.kernels.advance, "function")
        if not coded or steps // every >= SHORT or start.translate or start.t0:
            return
        if len(self._waiting) >= KEPT:
            self._waiting.clear()
        waiting = self._waiting.setdefault((steps, every), [])
        if not waiting:
            waiting.append(PreparedRun(edge, start, steps, every))
