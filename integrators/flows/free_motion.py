"""Free motion: the kernels advance, the edge policy handles edges, rows become a trajectory."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

import numpy as np

from ..bisections import EdgePolicy
from ..compiler import Entry, KernelsAtStep, Status, taken_over, text_key
from ..errors import StepFailure
from ..geometry import StepContext
from ..groupoids import margin_of
from ..numbers import Double, Matrix, Vector, finite
from ..runs import Allocate, Trajectory
from ..runs import run as run_all
from .failures import check_two_form, failure_of_run
from .initial_state import Start

#: steps between two reports of progress, some hundredths of a second: compiled, and at many digits
CHUNK, CHUNK_OF_DIGITS = 2**19, 64
SHORT = 512  # rows that are looked at by one sum
WATCHED = 4096  # steps that are made again at once, to look at each
STRETCH = 64  # steps by Newton's method before a fixed point is tried again


class FreeMotion:
    """Motion without impulses, by Newton's method or the fixed point of stages (`runs.Stepper`).

    branch: the number of the branch of the step before, if it is known. watched: False for a part
    of a run, whose rows are looked at elsewhere. If the fixed point of the stages does not
    contract, Newton takes over for a while, each time twice as long.
    """

    ended = False
    #: the steps by Newton's method the next time, and the step to which it goes this time
    stretch, until = STRETCH, 0

    def __init__(
        self, edge: EdgePolicy, start: Start, branch: object = None, watched: bool = True
    ) -> None:
        self.edge, self.start, self.branch, self.watched = edge, start, branch, watched
        self.numbers, self.name = edge.context.numbers, edge.context.scene.name
        self.by_stages = edge.stages is not None

    @property
    def machine(self) -> KernelsAtStep:
        """The kernels that make the coming steps."""
        return self.edge.stages if self.by_stages else self.edge.machine

    def _coefficients(self, translate: int) -> Matrix:
        return self.machine.c if self.by_stages else self.edge.coefficients(translate)

    def begin(self, steps: int, every: int, allocate: Allocate | None = None) -> None:
        at, machine = self.start, self.machine
        point = machine.start_at(at.x, at.mu, self._coefficients(at.translate), at.guess)
        self.arrays = run = machine.buffers(point, steps, every, self.edge.begun, allocate)
        run.translate = at.translate
        if self.branch is not None:
            run.totals[Entry.BRANCH] = self.branch

    @property
    def index(self) -> int:
        """The number of steps done."""
        return self.arrays.index

    @property
    def whole(self) -> int:
        """The number of complete rows."""
        run = self.arrays
        return run.steps // run.every + 1 if self.ended else -(-run.index // run.every)

    def advance(self) -> int:
        edge, run, by_stages = self.edge, self.arrays, self.by_stages
        first, chunk = run.index, CHUNK if self.numbers.dtype is np.float64 else CHUNK_OF_DIGITS
        stop = min(run.steps, first + chunk)
        if edge.stages is not None and not by_stages:
            stop = min(stop, self.until)
        status = self.machine.advance(run, stop)
        if status and by_stages:
            if edge.stages.alone:
                return status
            taken_over(run, edge.stages, edge.machine, self.start.guess)
            self.by_stages, self.until = False, run.index + self.stretch
            self.stretch *= 2
            return Status.OK
        at_end = run.index == run.steps
        if status in edge.handles:
            status = edge.resume(run, status)
        if not by_stages:
            run.by_newton += run.index - first
        self.ended = at_end and not status
        if not (by_stages or status or at_end or edge.stages is None or run.index < self.until):
            taken_over(run, edge.machine, edge.stages, self.start.guess)
            self.by_stages = True
        return status

    @property
    def key(self) -> str:
        at, context = self.start, self.edge.context
        numbers = [*at.x, *at.mu, *at.guess, *(e for part in context.parts for e in part.q)]
        words = type(self.edge).__name__, context.step, self.numbers.digits, at.translate, at.t0
        return text_key(self.edge.system(), self.by_stages, *map(str, words), *map(str, numbers))

    @property
    def state(self) -> dict[str, np.ndarray]:
        run = self.arrays
        at = (run.index, run.translate, run.changes, run.by_newton,
              self.by_stages, self.stretch, self.until, self.ended)  # fmt: skip
        return {"state": run.state, "totals": run.totals, "at": np.array(at, dtype=np.int64)}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        run, at = self.arrays, state["at"].tolist()
        run.index, run.translate, run.changes, run.by_newton = at[:4]
        self.by_stages, self.ended = bool(at[4]), bool(at[7])
        self.stretch, self.until = at[5:7]
        run.state, run.totals[:] = state["state"], state["totals"]
        run.c = self._coefficients(run.translate)

    def failure(self, status: int) -> StepFailure:
        edge, run = self.edge, self.arrays
        if edge.stages is not None and edge.stages.alone:
            return edge.context.failure(
                "the fixed point of the stages does not contract", {}, run.index
            )
        if (good := self._finite_rows(self.whole)) is not None:
            return self._no_longer_finite(good)
        return failure_of_run(edge, run, status, self.rows_of(self.whole))

    def trajectory(self) -> Trajectory:
        """Return the rows; raises `StepFailure` where they are not finite, or dϑ is singular."""
        context, run, count = self.edge.context, self.arrays, self.whole
        good = self._finite_rows(count)
        if good is None and run.steps % run.every:  # then the end is no row
            end = self.machine.point(run.state)
            good = None if all(finite(e).all() for e in end) else count
        if good is not None:
            raise self._no_longer_finite(good)
        rows = self.rows_of(count)
        if self.watched and context.equations.s.degenerate:
            check_two_form(context, rows)
            # with more digits than a double has steps are dear, and rows alone are looked at
            if run.every > 1 and isinstance(self.numbers, Double):
                self._watch()
        return rows

    def _watch(self) -> None:
        """Raise `StepFailure` if a step passes a state where dϑ is singular: all steps are rows.

        Steps are made again, `WATCHED` at once.
        """
        context, start, first, steps = self.edge.context, self.start, 0, self.arrays.steps
        while first < steps:
            part = run_all(FreeMotion(self.edge, start, watched=False), min(WATCHED, steps - first))
            check_two_form(context, part, first)
            first += part.steps
            x, mu, u = (np.array(e[-1]) for e in (part.base, part.mu, part.u))
            start = Start(x, mu, context.start(x, mu, u), t0=start.t0)

    def _finite_rows(self, count: int) -> int | None:
        """Return the number of finite rows at the beginning, or None if all rows are finite."""
        run = self.arrays
        if run.places is not None and run.steps < SHORT * run.every:
            states = run.states
            if isfinite(states.dot(states)):  # quick; it is too large only beyond 1e154
                return None
        columns = [finite(e[:count]) for e in (run.xs, run.mus)]
        if all(e.all() for e in columns):
            return None
        return int(np.flatnonzero(~np.hstack(columns).all(axis=1))[0])

    def _no_longer_finite(self, good: int) -> StepFailure:
        """Return the failure of the first non-finite step, found again from the last finite row.

        A kernel does not check x and μ in each step; it continues if no equation needs the lost
        number.
        """
        run, context, row = self.arrays, self.edge.context, max(good - 1, 0)
        first, x, mu = row * run.every, run.xs[row].copy(), run.mus[row].copy()
        guess = context.start(x, mu, run.us[row, : len(mu)].copy())
        again = FreeMotion(self.edge, Start(x, mu, guess, int(run.translates[row])))
        again.begin(min(run.every, run.steps - first), 1)
        while not (again.ended or again.advance()):
            pass
        columns, detail = (again.arrays.xs, again.arrays.mus), ""
        for k in range(min(again.index, again.arrays.steps) + 1):
            lost = [f"{name}[{i}]" for name, rows in zip(("x", "mu"), columns, strict=True)
                    for i in np.flatnonzero(~finite(rows[k]))]  # fmt: skip
            if lost:
                detail, first = f", first {lost[0]}", first + k - 1
                x, mu = (rows[k - 1] for rows in columns)
                break
        run.index = first
        said = f"the numbers are no longer finite{detail}"
        return context.failure(said, {"x": x, "mu": mu}, first, self.rows_of(good))

    def rows_of(self, count: int) -> Trajectory:
        """Return the first `count` rows."""
        if self.numbers.dtype is np.float64:  # its fields are computed when they are read
            return Trajectory.begun(self._fields, count)
        fields: dict[str, Any] = {}
        for name in ("x", "u", "mu", "t"):
            fields |= self._fields(count, name)
        return Trajectory(**fields)

    def _fields(self, count: int, name: str) -> dict[str, Any]:
        """Return the field of that name of the first `count` rows, and others at the same price."""
        run, context, public = self.arrays, self.edge.context, self.numbers.public
        if name in ("x", "base"):
            base = public(run.xs[:count])
            return {"x": base[:, : context.equations.s.n], "base": base}
        if name == "mu":
            return {"mu": public(run.mus[:count])}
        if name == "u":
            return {"u": public(self._velocities(count))}
        t0 = self.start.t0
        totals, m = run.totals, len(context.equations.u)
        t = self.numbers.multiples(context.step, np.arange(count, dtype=np.int64) * run.every)
        return {
            "t": public(t + self.numbers.number(t0) if t0 else t),
            "iterations": run.counts[:count],
            "newton_mean": float(totals[Entry.CORRECTIONS]) / (run.index + 1),
            "newton_max": int(totals[Entry.MOST]),
            "newton_residual": float(totals[Entry.LAST_SIZE]),
            "steps": run.index,
            "step": context.step,
            "margin": margin_of(totals[Entry.FARTHEST]),
            "edges": run.changes,
            "translates": run.translates[:count],
            "multipliers": public(run.us[:count, m:] * (2 / context.parts[0].h)),
            "solver": self._solver,
            "contraction": float(totals[Entry.CONTRACTION] ** (1 / max(1, totals[Entry.SWEEPS]))),
            "scheme": context.scheme,
        }

    def _velocities(self, count: int) -> Matrix:
        """Return u of the first `count` rows."""
        run, context, m = self.arrays, self.edge.context, len(self.edge.context.equations.u)
        us: Matrix = run.us[:count]
        if context.equations.arrows is not None or us.shape[1] > m or not count:
            return us[:, :m]
        near = np.repeat(context.vector(context.scene.v0, m)[None], count, axis=0)
        with self.numbers.working():
            velocities: Matrix = context.geometry.velocities(run.xs[:count], run.mus[:count], near)
        return velocities

    @property
    def _solver(self) -> str:
        if self.edge.stages is None:
            return "Newton"
        if not self.arrays.by_newton:
            return "fixed point"
        return f"fixed point, Newton in {self.arrays.by_newton} of {self.index} steps"


def first_u(edge: EdgePolicy, start: Start, branch: object = None) -> Vector:
    """Return u with F⁻(x, u) = hμ in the chart of e, for the first row of a run.

    Raises `StepFailure` if Newton diverges, `BadInput` if u is beyond that chart's edge.
    """
    if edge.context.equations.arrows is None:
        edge.context.check_one_arrow()
    run = run_all(FreeMotion(edge, start, branch), 0)
    if run.translates[0]:
        return np.asarray(edge.in_own_chart(element_of(edge.context, run, 0)))
    return _velocity(edge.context, run, 0)


def element_of(context: StepContext, run: Trajectory, row: int) -> Matrix:
    """Return the group element g = τ(hu) B of a row, N×N, within `numbers.working()`."""
    u = context.h * _velocity(context, run, row)
    return context.chart.element(u, int(run.translates[row]))


def _velocity(context: StepContext, run: Trajectory, row: int) -> Vector:
    """Return u of a row, converted back to the flow's own numbers."""
    return context.vector(run.u[row], run.u.shape[1])
