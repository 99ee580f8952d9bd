"""A program's run against the same steps made again: alone, or in runs that end there.

A step that is a map of the state and h gives the same after any other step, so that a run is its
steps, one by one. A method with memory, or one that makes whole runs, need not be a map of (q, p);
but each row of its run is the end of a run of so many steps.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from discmech.integrators import StepFailure
from discmech.integrators.extensions.foreign import guarded
from discmech.integrators.numbers import Vector

BESIDE = 0.01  # share of the motion's size by which the step in between begins elsewhere
ENDS = 8  # rows of a run for which runs that end there are made
#: relative change of the start that tells how far a row is moved by the last bits of earlier steps
NUDGE = 2.0**-30


def repeated(flow: Any, z: Vector, scale: Vector, steps: int, t0: Any = 0, seed: int = 0) -> float:
    """Return the largest difference of a run's rows from the same made again, over its motion.

    scale: the size of each entry of the state z. A run that fails differs by 0. For runs that end
    at a row the difference is over the growth of a change of the start, too, since threads may add
    in another order.
    """
    rule, n = flow.scheme.rule, flow.system.n
    try:
        run = flow.trajectory(steps, x0=z[:n], mu0=z[n:], t0=t0)
    except StepFailure:
        return 0.0
    states = np.hstack([run.x, run.mu]).astype(float)
    if not (rule.remembers or rule.runs):
        ends = (_alone(flow, before, scale, t0 + k * flow.step)
                for k, before in enumerate(states[:-1]))  # fmt: skip
        return max(_gap(a, b, scale) for a, b in zip(ends, states[1:], strict=True))
    drawn = np.random.default_rng(seed)
    chosen = np.unique([*drawn.integers(1, steps + 1, ENDS), steps])
    moved = guarded(flow.map_of(steps, t0, steps), steps * len(z))(z + NUDGE * scale)
    growth = np.abs(moved.reshape(steps, -1) - states[1:]) / (NUDGE * scale)
    grown = np.maximum.accumulate(np.nan_to_num(growth, nan=1.0, posinf=1.0).max(axis=1))
    found = [_gap(guarded(flow.map_of(int(k), t0), len(z))(z), states[k], scale)
             / max(1.0, grown[k - 1]) for k in chosen]  # fmt: skip
    return float(max(found))


def _alone(flow: Any, z: Vector, scale: Vector, t0: Any) -> Vector:
    """Return the end of a step that is made after one from another state."""
    step = guarded(flow.map_of(1, t0), len(z))
    step(z + BESIDE * scale)
    return step(z)


def _gap(a: Vector, b: Vector, scale: Vector) -> float:
    gap = np.abs(a - b) / (np.abs(b) + scale)
    return float(gap.max()) if np.isfinite(gap).all() else 1.0
