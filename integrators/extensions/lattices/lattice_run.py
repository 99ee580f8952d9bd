"""The state of a lattice during a run, in the arrays of the compiled driver."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any, TypeAlias

import numpy as np

from ...compiler import Entry, Status, cores
from ...errors import BadInput, StepFailure
from ...numbers import Matrix, Number, finite
from ...runs import Trajectory
from .sparse_steps import BEGIN, RUN, SHOW, SparseMatrix, SparseSteps

#: files that import this one have the classes of these names
LatticeFlow: TypeAlias = Any
LatticeScheme: TypeAlias = Any


class LatticeRun:
    """The state of a run: x, ν, the unknowns of the last steps, and counters."""

    def __init__(
        self, flow: LatticeFlow, x: np.ndarray, mu: np.ndarray, t0: Number = 0, index: int = 0
    ) -> None:
        self.flow, self.numbers = flow, flow.numbers
        self.x, self.mu = np.ascontiguousarray(x), np.ascontiguousarray(mu)
        self.nu, self.totals = self.numbers.zeros(*mu.shape), self.numbers.zeros(len(Entry))
        self.free = flow.lattice.free
        self.mu[~self.free] = 0
        #: the time of step 0
        self.t0, self.index, self.solved = self.numbers.number(t0), index, 0
        self.u = flow.exact(flow.lattice.start[1] * self.free[:, None])
        self._projection: LatticeRun | None = None
        self.kernels, self.by_stages = flow.kernels, flow.of_stages is not None
        #: the step from which Newton's method replaces a fixed point, or −1
        self.newton_since = -1
        self._prepare()
        self.begin()

    def _prepare(self) -> None:
        """Make arrays for the flow's kernels; the search for w begins with the velocities `u`."""
        flow, scheme, N = self.flow, self.flow.scheme, len(self.x)
        lattice, kernels, widths = flow.lattice, self.kernels, self.kernels.widths
        zeros = self.numbers.zeros
        self.past = [zeros(N, widths[word]) for word in ("w", "w1", "w2", "w3")]
        for w in () if self.by_stages else self.past:
            w[:, : self.u.shape[1]] = self.u
        self._work = work = zeros(1 if scheme.local else N, widths["work"])
        order, segments = segments_of(lattice.pairs)
        # with constraints fixed sites have equations too: those of multipliers, and u = 0
        solved = np.ones_like(self.free) if scheme.constraints else self.free
        ranges = ranges_of(solved)
        ties = zeros(1 if scheme.local else len(order), widths["ties"])
        own, of_bond = map(flow.exact, scheme.own_rows(order))
        q = scheme.q_values(flow.step, self.numbers, self.by_stages)
        c = zeros(len(q), widths["coefficients"])
        for row, (kind, values) in enumerate(zip(scheme.kinds, q, strict=True)):
            try:
                made = kernels.prepare[kind](values)
            except ArithmeticError:
                raise BadInput(
                    f"{lattice.name} with {scheme.rule.name}: its equations have no finite "
                    f"coefficients at the step {float(flow.step):g}; take another step."
                ) from None
            c[row, : len(made)] = made
        kinds, given = np.array(scheme.kinds, dtype=np.int64), zeros(len(q), widths["given"])
        if scheme.timed:
            sizes = [values[0] for values in q]
            for j, values in enumerate(q):
                given[j] = [self.t0 + sum(sizes[:j]), self.numbers.number(flow.step), *values]
        self.arguments = (
            self.x, self.nu, self.mu, *self.past, work, ties, own, of_bond, c, given, kinds, len(q),
            ranges, len(ranges), segments, len(segments), self.totals,
        )  # fmt: skip
        self.halves: TwoHalves | None = None
        several = scheme.substeps or kernels.affine or scheme.timed or zeros(0).dtype != np.float64
        if scheme.local and not several and len(self.x) >= LEAST:
            self.halves = TwoHalves(kernels.advance, self.arguments)
        #: the digest of the data of a run in its arrays
        self.digest = hashlib.sha256(str(self.t0).encode())
        for array in (self.x, self.mu, self.u, own, of_bond, c, given, ranges, segments):
            exact = array if array.dtype != object else np.array([*map(str, array.flat)])
            self.digest.update(exact.tobytes())
        more = widths["w"] - self.u.shape[1] if scheme.constraints else 0
        self.multipliers = zeros(len(order), more)
        self._of_impulse = 2 / q[0][0]  # factor that turns an impulse hλ/2 into λ
        self.sparse: SparseSteps | None = None
        if lattice.shape == "list" and not (scheme.local or self.by_stages):
            matrix = SparseMatrix(lattice.pairs[order], solved, widths["w"])
            self.sparse = SparseSteps(
                self._task, self.past, work, ties, self.totals, matrix, len(q), self._floor,
                moving=widths["w"] - more, numbers=self.numbers,
            )  # fmt: skip

    def begin(self) -> None:
        """Start from x and μ: find w of the first step, from the guess in `past`."""
        self.totals[:] = 0 * self.totals[0]
        self.totals[Entry.KAPPA], self.totals[Entry.STEPS] = self.kernels.huge, self.index
        self.status = self._task(BEGIN, 0)[1]
        if self.sparse is not None:
            self.status = self.sparse.begin()
        if self.status != Status.OK and self.by_stages:
            self._continue_by_newton(self.mu)

    def _continue_by_newton(self, mu: np.ndarray, near: np.ndarray | None = None) -> None:
        """Continue at x and these μ with Newton's method, because no fixed point was found.

        near: w of the step before, with which the search begins; without it that begins with `u`.
        """
        self.kernels, self.by_stages, self.newton_since = self.flow.newton, False, self.index
        self.mu[:] = mu
        total, most = self.totals[[Entry.CORRECTIONS, Entry.MOST]]
        self._prepare()
        if near is not None:
            for w in self.past:
                w[:] = near
        self.begin()
        self.totals[Entry.CORRECTIONS] += total
        self.totals[Entry.MOST] = max(most, self.totals[Entry.MOST])

    @classmethod
    def from_row(cls, flow: LatticeFlow, x: Matrix, mu: Matrix, t: Number = 0) -> LatticeRun:
        """Return a run that starts from a row of another one; raises `StepFailure`."""
        run = cls(flow, x.copy(), mu.copy(), t)
        run.checked(run.show())
        return run

    def stepped(self) -> np.ndarray:
        """Take one step, show it and return its unknowns; raises `StepFailure`."""
        w = self.past[int(self.flow.scheme.local)].copy()
        self.checked(self.advance(1))
        self.checked(self.show())
        return w

    @property
    def t(self) -> Number:
        """The time."""
        return self.t0 + self.index * self.numbers.number(self.flow.step)

    def _floor(self) -> float:
        """Return the size of corrections too small to move x (`lattice_newton.unseen`)."""
        joined = len(self.x) if self.flow.scheme.constraints else 1
        largest = float(abs(self.x).sum(axis=1).max())
        return 16 * float(self.numbers.eps) * joined * largest / abs(float(self.flow.step))

    def _task(self, task: int, j: int) -> tuple[int, int]:
        return self.kernels.advance(task, j, *self.arguments)

    def advance(self, steps: int) -> int:
        """Take `steps` steps; return the status."""
        if self.status != Status.OK or steps == 0:
            return self.status
        way = self.sparse or self.halves
        done, status = way.steps(steps) if way else self._task(RUN, steps)
        self.index += done
        self.solved += done * (len(self.x) if self.flow.scheme.local else 1)
        if status != Status.OK and self.by_stages:
            self._continue_by_newton(self.nu, self.past[0].copy())
            return self.advance(steps - done)
        return status

    @property
    def state(self) -> dict[str, np.ndarray]:
        """The arrays on which the coming steps depend."""
        arrays = {"x": self.x, "nu": self.nu, "totals": self.totals}
        if self.by_stages:  # they contain the end of the solved step
            arrays["work"] = self._work
        counts = [self.index, self.solved, self.newton_since,
                  *([int(self.sparse.relaxing)] if self.sparse else ())]  # fmt: skip
        return {**arrays, **{f"w{i}": w for i, w in enumerate(self.past)},
                "counts": np.array(counts)}  # fmt: skip

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Continue from a saved state."""
        index, solved, since, *relaxing = map(int, state["counts"])
        if self.by_stages and since >= 0:
            self._continue_by_newton(self.mu)
        self.index, self.solved, self.newton_since = index, solved, since
        for name, array in self.state.items():
            if name != "counts":
                array[:] = state[name]
        self.status = Status.OK
        if self.sparse is not None:
            self.sparse.relaxing = bool(relaxing[0])

    def show(self) -> int:
        """Write the present μ and u into `mu` and `u`; return the status.

        If no iteration would notice, this checks that the state is finite.
        """
        _, status = self._task(SHOW, 0)
        self.u[:] = self.past[int(self.flow.scheme.local)][:, : self.u.shape[1]]
        if status == Status.OK and self.multipliers.shape[1]:
            status = self._project()
        self.mu[~self.free] = 0
        if status == Status.OK:
            status = self._finite_status(self.x, self.mu, self.u)
        return status

    def end(self) -> int:
        """Check that a state which was not shown is finite; return the status."""
        return self._finite_status(self.x, self.nu) if self.status == Status.OK else self.status

    def _finite_status(self, *arrays: np.ndarray) -> int:
        if all(finite(e).all() for e in arrays):
            return Status.OK
        whole = np.all([finite(e).all(axis=1) for e in arrays], axis=0)
        self.totals[Entry.PLACE] = np.flatnonzero(~whole)[0]
        return Status.SINGULAR

    def _project(self) -> int:
        """Project `mu` onto the constraints, find the coming step's `multipliers`; return the
        status.

        It starts from u and uses no earlier rows, so a row of the run depends on the state alone.
        """
        inner = self._projection
        if inner is None:
            inner = LatticeRun(self.flow.projection, self.x, self.mu, self.t0, self.index)
            self._projection = inner
        inner.x[:], inner.mu[:], inner.index = self.x, self.mu, self.index
        m, owners = self.u.shape[1], self.flow.lattice.pairs[:, 1]
        inner.past[0][:] = self.numbers.zeros(*inner.past[0].shape)
        inner.past[0][:, :m] = self.u
        inner.begin()
        unknowns = inner.past[0]
        self.mu[:] = self.flow.momenta(self.x, unknowns[:, :m], self.t)
        self.multipliers[:] = self._of_impulse * (self.past[0] - unknowns)[owners, m:]
        self.totals[Entry.PLACE] = inner.totals[Entry.PLACE]
        return inner.status

    @property
    def projected(self) -> tuple[np.ndarray, np.ndarray]:
        """v (N, m) and the impulses ν (B, k) of the last `show` of a lattice with constraints."""
        assert self._projection is not None
        unknowns, m = self._projection.past[0], self.u.shape[1]
        return unknowns[:, :m].copy(), unknowns[self.flow.lattice.pairs[:, 1], m:].copy()

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """The columns of a row, as of the last `show`."""
        columns = {"x": self.x, "u": self.u, "mu": self.mu}
        return {**columns, "multipliers": self.multipliers} if self.multipliers.size else columns

    def checked(self, status: int) -> None:
        """Raise `StepFailure` unless the status is Status.OK."""
        if status != Status.OK:
            raise self.failure(status, None)

    def traced(self, x: np.ndarray, mu: np.ndarray, index: int) -> LatticeRun:
        """Repeat this run from its row of step `index` to the first step with non-finite numbers.

        Kernels continue there if no equation needs the number that is lost.
        """
        again = LatticeRun(self.flow, x.copy(), mu.copy(), self.t0, index)
        while again.index < self.index and again.advance(1) == Status.OK:
            if not finite(np.hstack([again.x, again.nu])).all():
                return again
        return self

    def failure(self, status: int, rows: Trajectory | None) -> StepFailure:
        """Return the failure of a step that was not found."""
        # sites are written in order, so the first one that is not finite is the cause, not a result
        written = np.hstack([self.x, self.nu]) if self.flow.scheme.local else self._work
        bad = np.flatnonzero(~finite(written).all(axis=1))
        named = status != Status.SINGULAR or len(bad) == 0
        i = int(self.totals[Entry.PLACE] if named else bad[0])
        cause = f"a correction is not finite: L is not finite or FL is singular at site {i}"
        if status == Status.NOT_CONVERGED:
            cause = f"Newton's method does not converge at site {i}"
        flow, index = self.flow, self.index
        if status == Status.SINGULAR and self.sparse is None and not flow.scheme.local:
            cause = cause.removesuffix(f" at site {i}") + (
                ", or a pivot is 0 in the fixed order of a chain (its bonds as a list of pairs are "
                f"solved with row exchanges), at site {i}"
            )
        if status == Status.SINGULAR:
            for name, part in (("x", self.x), ("mu", self.nu)):
                if len(lost := np.argwhere(~finite(part))):
                    i, k = map(int, lost[0])
                    cause = f"the numbers are no longer finite, first {name}[{k}] at site {i}"
                    break
        state = {"x": self.x[i], "mu": self.mu[i]}
        return StepFailure(
            flow.lattice.name, flow.scheme.rule.name, index, float(self.t), state,
            cause, rows,
        )  # fmt: skip


def segments_of(pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (order of the bonds, segments (pieces, 4)) with rows (a, b, length, k).

    They are those of `lattice_driver`: consecutive bonds with the same offset j − i are one
    segment.
    """
    order = np.lexsort((pairs[:, 0], pairs[:, 1] - pairs[:, 0]))
    ends = pairs[order]
    starts = np.flatnonzero(np.r_[True, (np.diff(ends, axis=0) != 1).any(axis=1)])
    lengths = np.diff(np.r_[starts, len(ends)])
    return order, np.ascontiguousarray(np.c_[ends[starts], lengths, starts], dtype=np.int64)


def ranges_of(free: np.ndarray) -> np.ndarray:
    """Return rows (first, one past the last) of runs of free sites."""
    steps = np.diff(np.r_[0, free.astype(np.int64), 0])
    return np.ascontiguousarray(np.c_[np.flatnonzero(steps > 0), np.flatnonzero(steps < 0)])


# Steps of a lattice whose sites are solved separately, in two halves side by side.
#
# First each half moves its sites, then the bonds within each half act, at last those between the
# halves. So the forces on a site are always added in the same order, and a run with one core gives
# the same numbers. It pays if a site needs a solver: with 50,000 sites, bodies take 45 ns per site
# and step instead of 82, the flying spaghetti 87 instead of 168; with 5,000 sites 79 instead of 81
# and 118 instead of 161, since two threads must meet twice a step. Springs are explicit: two
# simultaneous runs of FPUT with 10⁶ sites take 0.85 instead of 0.57.


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
