"""Order in space: errors of fields on ever finer grids, against closed forms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from discmech.integrators import Scheme

from ..core.fitting import asymptotic_window, marks
from ..systems.known import SPACING, Known
from ..systems.lattice_system import LEAST

TIME = 4
FINER = 8  # the spacing is so many steps
LEVELS = 4, 5
STRAIGHT = 0.012  # as in the study of order


def in_space(rule: Any, known: Known) -> tuple[list[dict[str, Any]], float | None]:
    """Return rows {kind, step, error, used, why_not}, coarse to fine, and the slope of their line.

    The spacing of the grid, and with it the step, is halved repeatedly. error: the largest error of
    x or μ, each over its largest value.
    """
    rows, window = list[dict[str, Any]](), None
    for levels in LEVELS:
        rows += [_row(rule, known, k) for k in range(len(rows), levels)]
        steps, errors = zip(*((row["step"], row["error"] or math.nan) for row in rows), strict=True)
        window = asymptotic_window(steps, errors, LEAST, STRAIGHT)
        if window is not None:
            break
    for row, mark in zip(rows, marks([row["error"] for row in rows], window, LEAST), strict=True):
        row |= mark
    return rows, None if window is None else window.line.slope


def _row(rule: Any, known: Known, halvings: int) -> dict[str, Any]:
    """Return the row of the grid halved so many times; momenta are those of a site."""
    assert known.refined is not None and known.exact is not None
    spacing = SPACING / 2**halvings
    lattice = known.refined(spacing)
    flow: Any = Scheme(lattice, rule).flow(spacing / FINER)
    steps = round(TIME / (spacing / FINER))
    end = flow.trajectory(steps, steps)
    x, v = (e[:, None] for e in known.exact(lattice, TIME))
    mu = np.where(lattice.free[:, None], flow.momenta(x, v), 0)
    off = max(float(abs(a - b).max() / (abs(b).max() or 1))
              for a, b in ((end.x[-1], x), (end.mu[-1], mu)))  # fmt: skip
    return {"kind": "space", "step": float(spacing), "error": off}
