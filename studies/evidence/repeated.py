"""A program's run against the same steps made again: alone, or in runs that end there.

A step that is a map of the state and h gives the same after any other step, so that a run is its
steps, in any order. A method with memory, or one that makes whole runs, need not be a map of
(q, p); but each row of its run is the end of a run of so many steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators import StepFailure
from discmech.integrators.errors import Displaced
from discmech.integrators.numbers import Matrix, Vector
from discmech.reference import ReferenceFailure, many_motions

from .rows import velocities
from .scan import peaks

OTHER_STEP = Fraction(5, 8)  # of a flow's step
BESIDE = 1 / 16  # share of the motion's size by which a part of a start is changed
SHORT = 16  # steps of the runs from starts that share a part
ENDS = 8  # rows of a run, beside those that stand out, for which runs that end there are made


@dataclass(frozen=True)
class Again:
    """The largest difference of a run's rows from the same made again, over the motion.

    row: the number of the row; 0 for starts that end alike (`ends_alike`). error: how far the ends
    made again are from the motion itself, over the same; None if nobody knows it, or if
    single steps were made again.
    """

    gap: float
    row: int = 0
    error: float | None = None


def repeated(flow: Any, z: Vector, scale: Vector, steps: int, t0: Any = 0, seed: int = 0) -> Again:
    """Return the largest difference of a run's rows from the same made again.

    scale: the size of each entry of the state z. For runs that end at a row the difference is over
    the growth of a change of the start in the motion itself, since threads may add in another
    order. The rows are drawn, beside those at which the run is least smooth. Raises `StepFailure`
    for a run that fails.
    """
    rule, n = flow.scheme.rule, flow.system.n
    run = flow.trajectory(steps, x0=z[:n], mu0=z[n:], t0=t0)
    states = np.hstack([run.x, run.mu]).astype(float)
    if rule.repeats:
        row, gap = in_another_order(flow, states, scale, t0)
        return Again(gap, row)
    if ends_alike(flow, z, scale, min(steps, SHORT), t0):
        return Again(1.0, error=0.0)
    drawn = np.random.default_rng(seed).integers(1, steps + 1, ENDS)
    smooth = sorted(peaks(states / scale, 1, rule.unit(16)), reverse=True)[:ENDS]
    rows = np.unique([*drawn, *(row for _, row in smooth if row), steps])
    made = np.array([flow.map_of(int(k), t0)(z) for k in rows])
    exact, grown = _motion(flow, run, scale, rows, t0)
    gaps = [_gap(a, states[k], scale) / g for a, k, g in zip(made, rows, grown, strict=True)]
    error = None if exact is None else max(map(_gap, made, exact, [scale] * len(rows)))
    return Again(float(max(gaps)), int(rows[int(np.argmax(gaps))]), error)


def _motion(
    flow: Any, run: Any, scale: Vector, rows: Matrix, t0: Any
) -> tuple[Matrix | None, Vector]:
    """Return (the motion itself at some rows of a run, how it enlarges a change of its start).

    It enlarges none where it is not known.
    """
    scheme, n = flow.scheme, flow.system.n
    v = velocities(scheme, run)
    x, v = (np.repeat(np.asarray(part[:1], dtype=float), len(rows), 0) for part in (run.x, v))
    of_v = np.abs(v[0]).max(initial=0.0) * np.ones(v.shape[1]) * (n == 0)  # else x moves it
    try:
        ends = many_motions(scheme.scene).after(
            x, v, np.full(len(rows), float(t0)), rows * float(flow.step),
            np.concatenate([scale[:n], of_v]),
        )  # fmt: skip
    except ReferenceFailure:
        return None, np.ones(len(rows))
    grown = np.nan_to_num(ends.grown / scale, nan=1.0, posinf=1.0).max(axis=1)
    return np.hstack([ends.x, ends.mu]), np.maximum.accumulate(np.maximum(1.0, grown))


def ends_alike(flow: Any, z: Vector, scale: Vector, steps: int = SHORT, t0: Any = 0) -> bool:
    """True if runs from starts that share x, or μ, have one end, or by steps of two sizes.

    What is remembered is then known by a part of what it depends on. The starts are so far apart
    that rounded answers are, too. Raises `Displaced` if the answer begins at an earlier start.
    """
    n, own = flow.system.n, flow.map_of(steps, t0)(z)
    other = flow.scheme.flow(flow.scheme.rule.step_for(OTHER_STEP * flow.step))
    made = [] if other.step == flow.step or np.array_equal(own, z) else [(other, z)]
    bound = flow.scheme.scene.all_constraints or flow.scheme.s.degenerate  # x says what μ is
    for part in (slice(n), slice(n, None)) if not bound else ():
        moved = z.copy()
        moved[part] += BESIDE * scale[part]
        made += [(flow, moved)] * (not np.array_equal(moved, z))
    for by, start in made:
        try:
            if np.array_equal(by.map_of(steps, t0)(start), own):
                return True
        except Displaced:
            raise
        except StepFailure:
            continue
    return False


def in_another_order(flow: Any, states: Matrix, scale: Vector, t0: Any = 0) -> tuple[int, float]:
    """Return (the row of a run (r, k) whose step, made again among the others in another order,
    ends farthest from it, that distance over the motion)."""
    gaps = np.zeros(len(states) - 1)
    for k in map(int, np.random.default_rng(len(gaps)).permutation(len(gaps))):
        end = np.asarray(flow.map_of(1, t0 + k * flow.step)(states[k]))
        gaps[k] = _gap(end, states[k + 1], scale)
    return int(gaps.argmax()) + 1, float(gaps.max())


def _gap(a: Vector, b: Vector, scale: Vector) -> float:
    gap = np.abs(a - b) / (np.abs(b) + scale)
    return float(gap.max()) if np.isfinite(gap).all() else 1.0
