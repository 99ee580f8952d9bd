"""Runs: the driver advances, the edge policy handles edges, rows become a trajectory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np

from ..bisections import EdgePolicy
from ..compiler import Entry, Run, taken_over
from ..errors import StepFailure
from ..geometry import StepContext
from ..groupoids import margin_of
from ..numbers import Arithmetic, Double, Matrix, Numbers, Vector, finite
from ..numbers.types import Exact
from .failures import check_two_form, failure_of_run
from .initial_state import Start

Progress: TypeAlias = Callable[[int], None] | None  # called with the number of steps so far

#: steps between two reports of progress, some hundredths of a second: compiled, and at many digits
CHUNK, CHUNK_OF_DIGITS = 2**19, 64
SHORT = 64  # the times of runs with at most so many rows are remembered
WATCHED = 4096  # steps that are made again at once, to look at each
STRETCH = 64  # steps by Newton's method before a fixed point is tried again


@dataclass(frozen=True)
class Trajectory:
    """Rows of a run: the first is the start, then every `every`-th step.

    t (r,), x (r, n), u (r, m), mu (r, m): row k holds x_k, μ_k = F⁻/h in the natural basis, and the
    u that leaves x_k; for a one-step map, which has no arrows, ξ(x_k, μ_k). base: x, with the time
    as last column if the equations contain it: the form that the flow's own functions take.
    multipliers (r, k): λ of the constraints at the start of that row's step, in the natural basis.
    iterations (r,): Newton corrections of that row's step. newton_mean and newton_max: over all
    steps, with or without a row; newton_residual: size of the last correction. margin: the smallest
    of all steps in the charts of groups (`chart_margin.Position`; 1 if there is no edge; a lower
    bound for the exponential without a closed form). edges: how often the edge was met and passed;
    translates (r,): the number of the cover's element B with g = τ(hu) B, 0 for e. solver: how
    steps were solved ("fixed point", "Newton", or both with the number of steps by Newton); for a
    fixed point, iterations are its sweeps, and contraction is the factor by which a sweep reduces
    an error, in the step with most sweeps. scheme: the scheme that ran.
    """

    t: Vector
    x: Matrix
    u: Matrix
    mu: Matrix
    iterations: Vector
    newton_mean: float
    newton_max: int
    newton_residual: float
    steps: int
    step: Fraction
    margin: float
    edges: int
    translates: Vector
    base: Matrix
    multipliers: Matrix
    solver: str
    contraction: float
    scheme: Any = field(kw_only=True, repr=False, compare=False)

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields without the scheme, whose functions may not be picklable."""
        return {**vars(self), "scheme": None}


def run_from(
    edge: EdgePolicy,
    start: Start,
    steps: int,
    every: int = 1,
    progress: Progress = None,
    branch: object = None,
) -> Trajectory:
    """Run `steps` steps from a start, with a row every `every` steps, within `numbers.working()`.

    branch: the number of the branch of the step before, if it is known. Raises `StepFailure`, with
    the rows so far, if a step cannot be solved.
    """
    rows = _rows_from(edge, start, steps, every, progress, branch)
    if edge.context.equations.s.degenerate:
        check_two_form(edge.context, rows)
        # with more digits than a double has steps are dear, and rows alone are looked at
        if every > 1 and isinstance(edge.context.numbers, Double):
            _watch(edge, start, rows.steps)
    return rows


def _rows_from(
    edge: EdgePolicy,
    start: Start,
    steps: int,
    every: int = 1,
    progress: Progress = None,
    branch: object = None,
) -> Trajectory:
    if edge.stages is not None:
        machine, c = edge.stages, edge.stages.c
    else:
        machine, c = edge.machine, edge.coefficients(start.translate)
    run = machine.buffers(machine.start_at(start.x, start.mu, c, start.guess), steps, every)
    run.translate = start.translate
    edge.begin(run, branch)
    status = _advance(edge, run, progress, start.guess)
    if status and edge.stages is not None and edge.stages.alone:
        raise edge.context.failure("the fixed point of the stages does not contract", {}, run.index)
    count = -(-run.index // every) if status else steps // every + 1
    if (good := _finite_rows(edge, run, count, status)) is not None:
        raise _no_longer_finite(edge, run, good, start.t0)
    rows = rows_of(edge, run, count, start.t0)
    if status:
        raise failure_of_run(edge, run, status, rows)
    return rows


def _watch(edge: EdgePolicy, start: Start, steps: int) -> None:
    """Raise `StepFailure` if a step passes a state where dϑ is singular: all steps are rows here.

    Steps are made again, `WATCHED` at once.
    """
    context, first = edge.context, 0
    while first < steps:
        part = _rows_from(edge, start, min(WATCHED, steps - first))
        check_two_form(context, part, first)
        first += part.steps
        x, mu, u = (np.array(e[-1]) for e in (part.base, part.mu, part.u))
        start = Start(x, mu, context.start(x, mu, u), t0=start.t0)


def _finite_rows(edge: EdgePolicy, run: Run, count: int, status: int) -> int | None:
    """Return the number of finite rows at the beginning, or None if rows and end are all finite."""
    for columns in (run.xs[:count], run.mus[:count]):
        if not finite(columns).all():
            rows = finite(run.xs[:count]).all(axis=1) & finite(run.mus[:count]).all(axis=1)
            return int(np.flatnonzero(~rows)[0])
    machine = edge.machine if edge.stages is None else edge.stages
    lost = not (status or all(finite(part).all() for part in machine.point(run.state)))
    return count if lost else None


def _no_longer_finite(edge: EdgePolicy, run: Run, good: int, t0: Exact) -> StepFailure:
    """Return the failure of the first non-finite step, found again from the last finite row.

    A kernel does not check x and μ in each step; it continues if no equation needs the lost number.
    """
    row, context = max(good - 1, 0), edge.context
    first, x, mu = row * run.every, run.xs[row].copy(), run.mus[row].copy()
    steps = min(run.every, run.steps - first)
    guess, translate = context.start(x, mu, run.us[row, : len(mu)].copy()), run.translates[row]
    machine = edge.machine if edge.stages is None else edge.stages
    c = edge.coefficients(int(translate)) if edge.stages is None else edge.stages.c
    again = machine.buffers(machine.start_at(x, mu, c, guess), steps, 1)
    again.translate = int(translate)
    edge.begin(again, None)
    _advance(edge, again, None, guess)
    columns, found = (again.xs, again.mus), ""
    for k in range(min(again.index + 1, steps + 1)):
        lost = [f"{name}[{i}]" for name, rows in zip(("x", "mu"), columns, strict=True)
                for i in np.flatnonzero(~finite(rows[k]))]  # fmt: skip
        if lost:
            found, first = f", first {lost[0]}", first + k - 1
            x, mu = (rows[k - 1] for rows in columns)
            break
    run.index = first
    said = f"the numbers are no longer finite{found}"
    return context.failure(said, {"x": x, "mu": mu}, first, rows_of(edge, run, good, t0))


def first_u(edge: EdgePolicy, start: Start, branch: object = None) -> Vector:
    """Return u with F⁻(x, u) = hμ in the chart of e, for the first row of a run.

    Raises `StepFailure` if Newton diverges, `BadInput` if u is beyond that chart's edge.
    """
    if edge.context.equations.arrows is None:
        edge.context.check_one_arrow()
    run = run_from(edge, start, 0, branch=branch)
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


def _advance(
    edge: EdgePolicy, run: Run, progress: Callable[[int], None] | None, guess: Vector
) -> int:
    """Advance to the run's end or to a failing step; return the last status.

    If the fixed point of the stages does not contract, Newton takes over for a while, each time
    twice as long.
    """
    chunk = CHUNK if edge.context.numbers.dtype is np.float64 else CHUNK_OF_DIGITS
    stages, stretch, until = edge.stages, STRETCH, 0
    fixed = stages is not None
    while True:
        first, stop = run.index, min(run.steps, run.index + chunk)
        if stages is not None and fixed:
            status = stages.advance(run, stop)
            if status and stages.alone:
                return status
            if status:
                taken_over(run, stages, edge.machine, guess)
                fixed, until, stretch = False, run.index + stretch, 2 * stretch
                continue
        else:
            stop = min(stop, until) if stages is not None else stop
            status = edge.machine.advance(run, stop)
        ended = run.index == run.steps
        if status in edge.handles:
            status = edge.resume(run, status)
        if not fixed:
            run.by_newton += run.index - first
        if progress is not None:
            progress(run.index)
        if status or ended:
            return status
        if stages is not None and not fixed and run.index >= until:
            taken_over(run, edge.machine, stages, guess)
            fixed = True


def rows_of(edge: EdgePolicy, run: Run, count: int, t0: Exact) -> Trajectory:
    """Return the first `count` rows of a run that began at the time t0."""
    context = edge.context
    public = context.numbers.public
    us, base = run.us[:count], public(run.xs[:count])
    m = len(context.equations.u)
    us, multipliers = us[:, :m], us[:, m:]
    if context.equations.arrows is None and not multipliers.shape[1] and count:
        near = np.repeat(context.vector(context.scene.v0, us.shape[1])[None], count, axis=0)
        us = context.geometry.velocities(run.xs[:count], run.mus[:count], near)
    return Trajectory(
        t=_times(context.numbers, context.step, count, run.every, t0),
        x=base[:, : context.equations.s.n],
        u=public(us),
        mu=public(run.mus[:count]),
        iterations=run.counts[:count],
        steps=run.index,
        step=context.step,
        translates=run.translates[:count],
        edges=run.changes,
        base=base,
        multipliers=public(multipliers * (2 / context.parts[0].h)),
        solver=_solver(edge, run),
        scheme=context.scheme,
        **counted(run.totals, run.index),
    )


def counted(totals: Numbers, steps: int) -> dict[str, Any]:
    """Return the driver's counters over all steps, as fields of a trajectory."""
    return {
        "newton_mean": float(totals[Entry.CORRECTIONS]) / (steps + 1),
        "newton_max": int(totals[Entry.MOST]),
        "newton_residual": float(totals[Entry.LAST_SIZE]),
        "margin": margin_of(totals[Entry.FARTHEST]),
        "contraction": float(totals[Entry.CONTRACTION] ** (1 / max(1, totals[Entry.SWEEPS]))),
    }


def _times(numbers: Arithmetic, step: Fraction, count: int, every: int, t0: Exact) -> Vector:
    """Return the times of the first rows; those of short runs are remembered."""
    times = _short_times if count <= SHORT else _short_times.__wrapped__
    return times(numbers, step, count, every, t0).copy()


@lru_cache(maxsize=64)
def _short_times(numbers: Arithmetic, step: Fraction, count: int, every: int, t0: Exact) -> Vector:
    t = numbers.multiples(step, np.arange(count, dtype=np.int64) * every)
    return numbers.public(t + numbers.number(t0) if t0 else t)


def _solver(edge: EdgePolicy, run: Run) -> str:
    if edge.stages is None:
        return "Newton"
    if not run.by_newton:
        return "fixed point"
    return f"fixed point, Newton in {run.by_newton} of {run.index} steps"
