"""The kernels of a system at one step size, with the arrays they work on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from threading import RLock
from typing import TypeAlias

import numpy as np

from ..errors import BadInput
from ..numbers import Arithmetic, Matrix, Number, Numbers, Vector
from .kernels import Kernels
from .layout import BRANCH, ENTRIES, OK, PAST, REACH, SINGULAR, SLACK

#: a state and the coefficients in use: what a run goes on from
Lead: TypeAlias = tuple[Vector, Matrix]


@dataclass
class Run:
    """The arrays that the driver works on, and where it is; rows as in `run.Trajectory`.

    state: x, μ and what stands behind them (`Layout`); c: the coefficients in use, one row each
    substep. translates: of each row, the translate that its u is written in; changes: how often
    an edge was met; by_newton: steps taken by Newton's method.
    """

    state: Vector
    c: Matrix
    steps: int
    every: int
    xs: Matrix
    us: Matrix
    mus: Matrix
    counts: Vector
    totals: Vector
    translates: Vector
    index: int = 0
    translate: int = 0
    changes: int = 0
    by_newton: int = 0

    @property
    def lead(self) -> Lead:
        """What a further run would go on from."""
        return self.state, self.c

    @property
    def rows(self) -> tuple[Vector, ...]:
        """What the driver writes."""
        return self.xs, self.us, self.mus, self.counts, self.totals


class KernelsAtStep:
    """Kernels, coefficients and buffers of a flow.

    qs: the values of q, one list each substep, of which kinds says 0 for the rule and 1 for its
    adjoint. name: how messages call it.
    """

    def __init__(
        self,
        kernels: Kernels,
        numbers: Arithmetic,
        qs: Sequence[list[Number]],
        kinds: Sequence[int] = (0,),
        name: str = "",
    ) -> None:
        self.kernels, self.numbers, self.qs, self.name = kernels, numbers, qs, name
        self.kinds = np.array(kinds, dtype=np.int64)
        self.layout = kernels.layout
        self._known: dict[tuple[int, int], Matrix] = {}
        self._translates: dict[int, tuple[Matrix, Matrix] | None] = {}
        self._lock = RLock()  # members of an ensemble share what is known

    @cached_property
    def c(self) -> Matrix:
        """The coefficients of a whole step, in the chart of e."""
        return self.coefficients()

    def coefficients(
        self, key: int = 0, translate: tuple[Matrix, Matrix] | None = None, halvings: int = 0
    ) -> Matrix:
        """c at h/2^halvings, one row each substep, and the translate (B, B⁻¹) of number `key`.

        A translate of None is e. Raises `BadInput` if a coefficient is not finite.
        """
        with self._lock:
            if (key, halvings) not in self._known:
                table = self.numbers.zeros(len(self.qs), self.layout.width)
                letters = [e for matrix in translate or () for e in matrix.ravel()]
                rows: dict[tuple[int, Number], Vector] = {}  # substeps of one size are many
                for entries, kind, (h, *rest) in zip(table, self.kinds, self.qs, strict=True):
                    if (kind, h) not in rows:
                        q = [h / 2**halvings, *rest[: len(rest) - len(letters)], *letters]
                        rows[kind, h] = self._prepared(self.kernels.prepare[kind], q)
                    entries[: len(rows[kind, h])] = rows[kind, h]
                self._known[key, halvings], self._translates[key] = table, translate
            return self._known[key, halvings]

    def _prepared(self, prepare: Callable[[Numbers], Sequence[Number]], q: list[Number]) -> Vector:
        try:
            return np.array(prepare(q), dtype=self.numbers.dtype)
        except (ZeroDivisionError, OverflowError, ValueError) as error:
            raise BadInput(
                f"{self.name}: FL is singular or a coefficient is not finite ({error}); every "
                "velocity needs its kinetic energy, and parameters their proper units."
            ) from None

    # -- the state ------------------------------------------------------------------------------

    def buffers(self, lead: Lead, steps: int, every: int) -> Run:
        """Empty rows for a run; raises `BadInput` if they do not fit into memory."""
        state, c = lead
        rows, n, m, w = steps // every + 1, self.layout.n, self.layout.m, self.layout.shown
        ends = [*accumulate((ENTRIES, rows * n, rows * w, rows * m))]
        try:  # all in two blocks: a short run should not take long to begin
            block = np.zeros(ends[-1], dtype=self.numbers.dtype)
            whole = np.zeros(2 * rows, dtype=np.int64)
        except (MemoryError, ValueError):  # ValueError: more entries than an array can have
            raise BadInput(
                f"{rows} rows do not fit into memory: keep fewer (every=, --every)."
            ) from None
        totals = block[:ENTRIES]
        totals[:] = self.numbers.zeros(ENTRIES)
        totals[REACH] = totals[BRANCH] = totals[SLACK] = self.kernels.huge
        xs, us, mus = (
            block[start : start + rows * k].reshape(rows, k)
            for start, k in zip(ends, (n, w, m), strict=False)
        )
        return Run(state, c, steps, every, xs, us, mus, whole[:rows], totals, whole[rows:])

    def lead(self, x: Numbers, mu: Numbers, c: Matrix, guess: Numbers) -> Lead:
        """(state, c) at (x, μ), nothing lost yet, one guess of each substep's u."""
        at = self.layout
        state = self.numbers.zeros(at.memory + len(self.qs) * at.row)
        self.place(state, x, mu, c)
        self.seed(state, guess)
        return state, c

    def place(self, state: Vector, x: Numbers, mu: Numbers, c: Matrix) -> None:
        """Put (x, μ) into a state."""
        first, second = self.layout.parts[:2]
        state[first], state[second] = x, mu
        self.recarry(state, c)

    def point(self, state: Vector) -> tuple[Vector, Vector]:
        """(x, μ) of a state."""
        x, mu, *_ = (state[part].copy() for part in self.layout.parts)
        return x, mu

    def recarry(self, state: Vector, c: Matrix) -> None:
        """Compute the reused functions of x anew."""
        if self.layout.reused:
            at = self.layout.parts
            state[at[-1]] = self.kernels.carry[0](state[at[0]], c[0])

    def seed(self, state: Vector, guess: Numbers) -> None:
        """Forget past solutions: Newton starts from the guess, with stages of 0 (straight path)."""
        for memory in self._memories(state):
            past = self._past(memory)
            past[:] = 0
            past[:, : len(guess)] = guess
            memory[-4:] = [0, 0, self.kernels.huge, sum(abs(g) for g in guess)]

    def history(self, state: Vector) -> list[Vector]:
        """The first substep's past solutions, latest first (none where no step is iterated)."""
        if self.kernels.affine[self.kinds[0]]:
            return []
        return list(self._past(self._memories(state)[0])[:, : self.layout.m].copy())

    def last_solution(self, lead: Lead) -> dict[str, Vector]:
        """{"u": that from which Newton started}, empty where no step is solved iteratively."""
        past = self.history(lead[0])
        return {"u": past[0]} if past else {}

    def _memories(self, state: Vector) -> Matrix | tuple[Vector, ...]:
        return state[self.layout.memory :].reshape(-1, self.layout.row) if self.layout.row else ()

    def _past(self, memory: Vector) -> Matrix:
        """View of the past solutions; order, age, κ and scale stand behind them."""
        return memory[:-4].reshape(PAST, self.layout.solved)

    # -- steps ----------------------------------------------------------------------------------

    def advance(self, run: Run, stop: int) -> int:
        """Run the compiled loop up to `stop`; returns the status it ended with.

        The row at the run's end gets its u, but no step.
        """
        status = self._loop(run, stop, len(self.kinds)) if run.index < stop else OK
        if status != OK or stop < run.steps:
            return status
        before = run.state[: self.layout.memory].copy()
        status = self._loop(run, stop + 1, 1)  # its first substep has the row's u
        run.state[: self.layout.memory], run.index = before, run.steps
        return status

    def _loop(self, run: Run, stop: int, substeps: int) -> int:
        """Steps up to `stop`; where a pivot is zero, one step with row exchanges."""
        status = self._driven(run, stop, substeps)
        while status == SINGULAR and self._exchanged(run, substeps):
            status = self._driven(run, stop, substeps) if run.index < stop else OK
        return status

    def _exchanged(self, run: Run, substeps: int) -> bool:
        """Whether a step that was not solved is taken by the kernels that exchange rows."""
        used = next((key for key, c in self._known.items() if c is run.c), None)
        if used is None or self._exchanging is None:
            return False
        key, halvings = used
        mine, run.c = run.c, self._exchanging.coefficients(key, self._translates[key], halvings)
        status = self._exchanging._driven(run, run.index + 1, substeps)
        run.c = mine
        return status == OK

    @cached_property
    def _exchanging(self) -> KernelsAtStep | None:
        if not self.kernels.exchanging or (kernels := self.kernels.exchanging()) is None:
            return None
        return KernelsAtStep(kernels, self.numbers, self.qs, list(self.kinds), self.name)

    def _driven(self, run: Run, stop: int, substeps: int) -> int:
        first = -(-run.index // run.every)
        run.index, status = self.kernels.advance(
            *(run.state, run.c, self.kinds, substeps, run.index, stop, run.every), *run.rows
        )
        if run.translate:
            run.translates[first : -(-run.index // run.every)] = run.translate
        return int(status)

    def one_step(self, run: Run) -> int:
        """One step and no more; at the run's end the u of its last row."""
        if run.index == run.steps:
            return self.advance(run, run.steps)
        return self._loop(run, run.index + 1, len(self.kinds))

    def solve(
        self, x: Numbers, mu: Numbers, c: Matrix, guess: Numbers
    ) -> tuple[Vector, Number] | None:
        """(u, number of its branch) of F⁻ = hμ from a guess, in the chart of c, or None.

        Nothing is watched, so the chart's edge is no obstacle.
        """
        run = self.buffers(self.lead(x, mu, c, guess), 0, 1)
        status = self.advance(run, 0)
        return None if status != OK else (run.us[0], run.totals[BRANCH])
