"""The kernels of a system at one step size, with the arrays they work on."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from threading import RLock
from typing import Any, TypeAlias

import numpy as np

from ..errors import BadInput
from ..numbers import Arithmetic, Matrix, Number, Numbers, Vector
from ..numbers.types import DType, Function
from .kernels import Kernels
from .layout import PAST, STATUSES, Entry, Layout, Status
from .machine_code import address

#: the point from which a run continues: the state and the coefficients in use
ResumePoint: TypeAlias = tuple[Vector, Matrix]


class Run:
    """The arrays that the driver works on, and its position; rows as in `runs.Trajectory`.

    state: x, μ and the rest of `Layout`; c: the coefficients in use, one row for each substep;
    xs, us, mus, counts and totals are written by the driver; translates: for each row, the number
    of the translate in which its u is written; changes: how often an edge was met; by_newton:
    number of steps solved by Newton's method. These arrays are given, or parts of one block of
    memory, which are looked up when they are read: of a short run few are. places: the addresses of
    what the driver writes, in a block.
    """

    index = translate = changes = by_newton = 0
    block: Vector
    places: tuple[int, ...] | None = None

    def __init__(self, point: ResumePoint, steps: int, every: int, layout: Layout) -> None:
        self.state, self.c = point
        self.steps, self.every, self.layout = steps, every, layout

    @property
    def states(self) -> Vector:
        """All of xs, us and mus, in a block."""
        return self.block[: (self.steps // self.every + 1) * self.layout.columns]

    def _part(self, first: int, width: int) -> Matrix:
        """Return rows of `width` numbers; the block begins with rows of `first` numbers."""
        rows = self.steps // self.every + 1
        return self.block[rows * first : rows * (first + width)].reshape(rows, width)

    @cached_property
    def xs(self) -> Matrix:
        """The points of the rows, with any time behind."""
        return self._part(0, self.layout.n)

    @cached_property
    def us(self) -> Matrix:
        """The unknowns of the steps that leave the rows."""
        return self._part(self.layout.n, self.layout.row_width)

    @cached_property
    def mus(self) -> Matrix:
        """The momenta of the rows."""
        return self._part(self.layout.n + self.layout.row_width, self.layout.m)

    @cached_property
    def counts(self) -> Vector:
        """The corrections of the steps that leave the rows."""
        return self._part(self.layout.columns, 1).view(np.int64)[:, 0]

    @cached_property
    def translates(self) -> Vector:
        """The numbers of the translates in which the rows' u are written."""
        return self._part(self.layout.columns + 1, 1).view(np.int64)[:, 0]

    @cached_property
    def totals(self) -> Vector:
        """The counters of the whole run, by `Entry`."""
        return self.block[-len(Entry) :]

    def count_in(self, totals: Vector) -> None:
        """Count in the counters of another run."""
        self.totals = totals
        if self.places is not None:
            self.places = *self.places[:-1], address(totals)

    @property
    def resume_point(self) -> ResumePoint:
        """(state, coefficients) from which the next call continues."""
        return self.state, self.c


class KernelsAtStep:
    """Kernels, coefficients and buffers of a flow.

    qs: the values of q, one list for each substep; kinds: for each, 0 if it is the rule and 1 if it
    is the adjoint. name: the name in messages.
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
        #: the arguments of the last start, and its state: most runs begin at the scene's own start
        self._begun: tuple[Any, ...] = (None, None, None, None, None)
        self._at_places: Any = getattr(kernels.advance, "at_places", None)
        self._kinds_at = address(self.kinds)
        self._lock = RLock()  # the members of an ensemble share the caches

    @cached_property
    def c(self) -> Matrix:
        """The coefficients of a whole step in the chart of e."""
        return self.coefficients()

    @cached_property
    def _c_at(self) -> int:
        return address(self.c)

    def coefficients(
        self, key: int = 0, translate: tuple[Matrix, Matrix] | None = None, halvings: int = 0
    ) -> Matrix:
        """Return c at h/2^halvings, one row for each substep.

        translate: the pair (B, B⁻¹) with the number `key`; None stands for e. Raises `BadInput` if
        a coefficient is not finite.
        """
        with self._lock:
            if (key, halvings) not in self._known:
                table = self.numbers.zeros(len(self.qs), self.layout.width)
                letters = [e for matrix in translate or () for e in matrix.ravel()]
                rows: dict[tuple[Number, ...], Vector] = {}  # many substeps have the same size
                for entries, kind, (h, *rest) in zip(table, self.kinds, self.qs, strict=True):
                    if (kind, h, *rest) not in rows:
                        q = [h / 2**halvings, *rest[: len(rest) - len(letters)], *letters]
                        rows[kind, h, *rest] = self._prepared(self.kernels.prepare[kind], q)
                    row = rows[kind, h, *rest]
                    entries[: len(row)] = row
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

    def buffers(
        self, point: ResumePoint, steps: int, every: int, totals: Vector | None = None,
        allocate: Function | None = None,
    ) -> Run:  # fmt: skip
        """Return empty rows for a run; raises `BadInput` if they do not fit into memory.

        totals: the counters and limits at its beginning. allocate: makes `count` rows of columns,
        given by (shape of a row, type) (`runs.Allocate`).
        """
        at, rows, run = self.layout, steps // every + 1, Run(point, steps, every, self.layout)
        begun = self._totals if totals is None else totals
        try:
            if allocate is None and self._at_places is not None:
                # one allocation in all, so that a short run begins quickly
                run.block = block = np.zeros(rows * (at.columns + 2) + len(begun))
                block[-len(begun) :] = begun
                begin, of_row = address(block), 8 * rows
                run.places = (
                    begin, begin + of_row * at.n, begin + of_row * (at.columns - at.m),
                    begin + of_row * at.columns, begin + of_row * (at.columns + 2),
                )  # fmt: skip
                return run
            widths = {"x": at.n, "u": at.row_width, "mu": at.m}
            columns: dict[str, tuple[tuple[int, ...], DType]]
            columns = {name: ((width,), self.numbers.dtype) for name, width in widths.items()}
            columns |= {"iterations": ((), int), "translates": ((), int)}
            arrays = (allocate or _zeros)(columns, rows)
        except BadInput:  # rows on disk that are not this run's
            raise
        except (MemoryError, ValueError):  # ValueError: more entries than an array can have
            raise BadInput(
                f"{rows} rows do not fit into memory: keep fewer (every=, --every)."
            ) from None
        run.xs, run.us, run.mus, run.counts, run.translates = arrays.values()
        run.totals = begun.copy()
        return run

    @cached_property
    def _totals(self) -> Vector:
        """The counters at the beginning of a run."""
        totals: Vector = self.numbers.zeros(len(Entry))
        totals[Entry.REACH] = totals[Entry.BRANCH] = totals[Entry.SLACK] = self.kernels.huge
        return totals

    def start_at(self, x: Numbers, mu: Numbers, c: Matrix, guess: Numbers) -> ResumePoint:
        """Return (state, c) at (x, μ), with no rounding errors, `guess` each substep's u."""
        a, b, of, near, state = self._begun
        if not (c is of and guess is near):
            state = self.numbers.zeros(self.layout.memory + len(self.qs) * self.layout.row)
            self.seed(state, guess)
        elif x is a and mu is b:
            return state.copy(), c
        else:
            state = state.copy()
        self.place(state, x, mu, c)
        self._begun = x, mu, c, guess, state
        return state.copy(), c

    def place(self, state: Vector, x: Numbers, mu: Numbers, c: Matrix) -> None:
        """Write (x, μ) into a state."""
        first, second = self.layout.parts[:2]
        state[first], state[second] = x, mu
        self.recarry(state, c)

    def point(self, state: Vector) -> tuple[Vector, Vector]:
        """Return copies of (x, μ) from a state."""
        x, mu, *_ = (state[part].copy() for part in self.layout.parts)
        return x, mu

    def recarry(self, state: Vector, c: Matrix) -> None:
        """Compute the reused functions of x anew."""
        if self.layout.reused:
            at = self.layout.parts
            state[at[-1]] = self.kernels.carry[self.kinds[0]](state[at[0]], c[0])

    def seed(self, state: Vector, guess: Numbers) -> None:
        """Replace past solutions by the guess, from which Newton starts, with stages of 0."""
        for memory in self._memories(state):
            past = self._past(memory)
            past[:] = 0
            past[:, : len(guess)] = guess
            memory[-4:] = [0, 0, self.kernels.huge, sum(abs(g) for g in guess)]

    def history(self, state: Vector) -> list[Vector]:
        """Return the first substep's past solutions, latest first ([] if no step is iterated)."""
        if self.kernels.affine[self.kinds[0]]:
            return []
        return list(self._past(self._memories(state)[0])[:, : self.layout.m].copy())

    def last_solution(self, point: ResumePoint) -> dict[str, Vector]:
        """Return {"u": the u from which Newton started}, or {} if no step is solved iteratively."""
        past = self.history(point[0])
        return {"u": past[0]} if past else {}

    def _memories(self, state: Vector) -> Matrix | tuple[Vector, ...]:
        return state[self.layout.memory :].reshape(-1, self.layout.row) if self.layout.row else ()

    def _past(self, memory: Vector) -> Matrix:
        """Return a view of the past solutions; order, age, κ and scale stand behind them."""
        return memory[:-4].reshape(PAST, self.layout.solved)

    def advance(self, run: Run, stop: int) -> int:
        """Run the compiled loop up to `stop` and return its status.

        At the end of the run the last row gets its u, but no further step is taken.
        """
        if len(self.kinds) == 1 and stop == run.steps and stop % run.every == 0:
            # the last row has the state of the end, which nobody asks for again
            status = self._loop(run, stop + 1, 1)
            run.index = min(run.index, stop)
            return status
        status = self._loop(run, stop, len(self.kinds)) if run.index < stop else Status.OK
        if status != Status.OK or stop < run.steps:
            return status
        before = run.state[: self.layout.memory].copy()
        status = self._loop(run, stop + 1, 1)  # the row's u is that of the first substep
        run.state[: self.layout.memory], run.index = before, run.steps
        return status

    def _loop(self, run: Run, stop: int, substeps: int) -> int:
        """Step up to `stop`; where that fails, by the careful kernels.

        A zero pivot is rare, so they take one step; rows that have much round-off stay so.
        """
        status = self._driven(run, stop, substeps)
        while status in (Status.SINGULAR, Status.NOT_CONVERGED):
            end = run.index + 1 if status == Status.SINGULAR else stop
            if not self._carefully(run, end, substeps):
                return status
            status = self._driven(run, stop, substeps) if run.index < stop else Status.OK
        return status

    def _carefully(self, run: Run, stop: int, substeps: int) -> bool:
        """Repeat a step that failed, and go on, by the careful kernels; True if that succeeds."""
        used = next((key for key, c in self._known.items() if c is run.c), None)
        if used is None or self._careful is None:
            return False
        key, halvings = used
        mine, run.c = run.c, self._careful.coefficients(key, self._translates[key], halvings)
        before, state = run.index, run.state.copy()
        self._careful._driven(run, stop, substeps)
        run.c = mine
        if run.index == before:  # what such a step ran off to is no start for shorter ones
            run.state[:] = state
        return run.index > before

    @cached_property
    def _careful(self) -> KernelsAtStep | None:
        if not self.kernels.careful or (kernels := self.kernels.careful()) is None:
            return None
        return KernelsAtStep(kernels, self.numbers, self.qs, list(self.kinds), self.name)

    def _driven(self, run: Run, stop: int, substeps: int) -> int:
        before = run.index
        how = substeps, before, stop, run.every
        if run.places is not None:
            c = self._c_at if run.c is self.c else address(run.c)
            arrays = address(run.state), c, self._kinds_at
            run.index, status = divmod(self._at_places(*arrays, *how, *run.places), STATUSES)
        else:
            written = run.xs, run.us, run.mus, run.counts, run.totals
            run.index, status = self.kernels.advance(run.state, run.c, self.kinds, *how, *written)
        if run.translate:
            first = -(-before // run.every)
            run.translates[first : -(-run.index // run.every)] = run.translate
        return status

    def one_step(self, run: Run) -> int:
        """Take exactly one step; at the end of the run compute the u of the last row instead."""
        if run.index == run.steps:
            return self.advance(run, run.steps)
        return self._loop(run, run.index + 1, len(self.kinds))

    def solve(
        self, x: Numbers, mu: Numbers, c: Matrix, guess: Numbers
    ) -> tuple[Vector, Number] | None:
        """Solve F⁻ = hμ from a guess in the chart of c: return (u, its branch number) or None.

        The edge of the chart is not checked, so it is no obstacle.
        """
        run = self.buffers(self.start_at(x, mu, c, guess), 0, 1)
        status = self.advance(run, 0)
        return None if status != Status.OK else (run.us[0], run.totals[Entry.BRANCH])


def _zeros(columns: Mapping[str, tuple[tuple[int, ...], DType]], count: int) -> dict[str, Vector]:
    return {name: np.zeros((count, *shape), kind) for name, (shape, kind) in columns.items()}


# The kernels of collocation at one step size, and the change of a run to other kernels.


class StagesAtStep(KernelsAtStep):
    """Kernels of collocation; a run may change between these and those of Newton's method.

    If `alone` is True, it may not change: it fails, and nothing is compiled for Newton's method.
    """

    alone = False

    def start_at(self, x: Numbers, mu: Numbers, c: Matrix, guess: Numbers) -> ResumePoint:
        """Return (state, c) at (x, μ); a fixed point does not use the guess."""
        at = self.layout
        state = self.numbers.zeros(at.memory + at.row)
        self.place(state, x, mu, c)
        return state, c

    def history(self, state: Vector) -> list[Vector]:
        """Return [the last u], or [] before the first step."""
        first = self.layout.memory + 1
        return [state[first : first + self.layout.m].copy()] if state[first - 1] else []


def taken_over(run: Run, one: KernelsAtStep, other: KernelsAtStep, guess: Numbers) -> None:
    """Continue a run of the kernels `one` with `other`, keeping the rounding errors of its sums.

    guess: the u to begin with if no step was taken yet.
    """
    past = one.history(run.state)
    x, mu, *lost = (run.state[part].copy() for part in one.layout.parts[:4])
    run.state, run.c = other.start_at(x, mu, other.c, past[0] if past else guess)
    for part, value in zip(other.layout.parts[2:4], lost, strict=True):
        run.state[part] = value
