"""A run: the driver advances, edges are mended, and what was kept becomes a trajectory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from ..bisections.edge_policies import Refuse, in_own_chart
from ..compiler.kernels_at_step import Run
from ..groupoids.chart_margin import margin_of
from .failures import failure_of_run

if TYPE_CHECKING:
    from .flow import Flow
    from .initial_state import Start

CHUNK, CHUNK_OF_DIGITS = 2**19, 64  # steps between two reports of progress


@dataclass(frozen=True)
class Trajectory:
    """Rows of a run: the first is the start, then each every-th step.

    t (r,), x (r, n), u (r, m), mu (r, m): row k holds x_k, μ_k = F⁻/h in the natural basis, and the
    u that leaves x_k. iterations (r,): Newton corrections of that row's step. newton_mean and
    newton_max: over all steps, kept or not; newton_residual: size of the last correction.
    margin: the smallest of all steps in the charts of groups (`neighbourhoods.Position`; 1 where
    there is no edge; a lower bound for the exponential where it has no closed form). edges: how
    often the edge was met and mended; translates (r,): the number of the element B of the cover
    with g = τ(hu) B, 0 for e.
    """

    t: np.ndarray
    x: np.ndarray
    u: np.ndarray
    mu: np.ndarray
    iterations: np.ndarray
    newton_mean: float
    newton_max: int
    newton_residual: float
    steps: int
    step: Fraction
    margin: float
    edges: int
    translates: np.ndarray


def run_from(
    flow: Flow,
    start: Start,
    steps: int,
    every: int = 1,
    progress: Callable[[int], None] | None = None,
    branch: object = None,
) -> Trajectory:
    """`steps` steps of a flow, each every-th row kept; the flow's numbers must be at work.

    branch: the number of the branch of the step before, if it is known. Raises `StepFailure`, with
    the rows so far, if a step cannot be solved.
    """
    machine, edge = flow.machine, flow.edge
    c = edge.coefficients(start.translate)
    run = machine.buffers(machine.lead(start.x, start.mu, c, start.guess), steps, every)
    run.translate = start.translate
    edge.begin(run, branch)
    status = _advance(flow, edge, run, progress)
    found = _rows(flow, run, -(-run.index // every) if status else steps // every + 1)
    if status:
        raise failure_of_run(flow, run, status, found)
    return found


def first_u(flow: Flow, start: Start, branch: object = None) -> np.ndarray:
    """The u with F⁻(x, u) = hμ in the chart of e, as a run from there begins.

    Raises `StepFailure` if it is not found, `BadInput` where that chart ends.
    """
    run = run_from(flow, start, 0, branch=branch)
    if run.translates[0]:
        return np.asarray(in_own_chart(flow, element_of(flow, run, 0)))
    return _velocity(flow, run, 0)


def element_of(flow: Flow, run: Trajectory, row: int) -> np.ndarray:
    """The group element g = τ(hu) B of a row, N×N; the flow's numbers must be at work."""
    u = flow._h * _velocity(flow, run, row)
    return flow.edge.chart.element(u, int(run.translates[row]))


def _velocity(flow: Flow, run: Trajectory, row: int) -> np.ndarray:
    """u of a row, in the flow's own numbers again."""
    return np.array([flow.numbers.number(e) for e in run.u[row]], dtype=flow.numbers.dtype)


def _advance(flow: Flow, edge: Refuse, run: Run, progress: Callable[[int], None] | None) -> int:
    """To the run's end, or to the step that no one can mend: its status."""
    chunk = CHUNK if flow.numbers.dtype is np.float64 else CHUNK_OF_DIGITS
    while True:
        status = flow.machine.advance(run, min(run.steps, run.index + chunk))
        ended = run.index == run.steps
        if status in edge.handles:
            status = edge.mend(run, status)
        if progress is not None:
            progress(run.index)
        if status or ended:
            return status


def _rows(flow: Flow, run: Run, kept: int) -> Trajectory:
    """The first `kept` rows of a run."""
    index, public = np.arange(kept, dtype=np.int64) * run.every, flow.numbers.public
    totals = run.totals
    return Trajectory(
        t=public(flow.numbers.multiples(flow.step, index)),
        x=public(run.xs[:kept]),
        u=public(run.us[:kept]),
        mu=public(run.mus[:kept]),
        iterations=run.counts[:kept],
        newton_mean=float(totals[0]) / (run.index + 1),
        newton_max=int(totals[1]),
        newton_residual=float(totals[2]),
        steps=run.index,
        step=flow.step,
        margin=margin_of(totals[3]),
        translates=run.translates[:kept],
        edges=run.changes,
    )
