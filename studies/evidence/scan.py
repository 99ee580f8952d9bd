"""The parts of a motion in which a rule may do something else than elsewhere.

A fault in a narrow part of the motion is missed by any few places. But a run of many short steps
goes through every part, and its rows are smooth but where the rule is not: differences of a high
order, over ever more rows, make them small and leave what a narrow part does. So a scan judges
nothing. It names the times at which differences stand out, and single steps from there are judged
as those from all other places.
"""

from __future__ import annotations

from fractions import Fraction
from math import comb

import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter

from discmech.integrators import Scheme
from discmech.integrators.errors import DiscmechError
from discmech.integrators.numbers import Matrix, Vector

ORDER = 8  # of the differences: where a run has so many rows a motion is smooth to round-off
#: rows of a run, divided by the number of its unknowns, and the least and largest distance of rows
ROWS, LEAST, WIDEST = 2**15, 2**11, 2**8
NEARBY = 64  # differences on either side, whose median is what the motion itself does there
#: times the differences nearby: the motion's own grow by less over `NEARBY` of them, or they are
#: among the largest, whose places cost some steps and deny nothing
STANDS_OUT = 100
#: round-offs of a difference: Σ binomials² of them in the square, and a walk between its rows
ROUND_OFFS = 8
MOST = 3  # places that are looked at
OF_PROGRAM = 16  # a long run of a program takes seconds, this a part of one


def times_that_stand_out(scheme: Scheme) -> list[Fraction]:
    """Return the times at which a run of short steps is least smooth; none where it is smooth.

    A program makes a part (`OF_PROGRAM`) of the steps that it can make soon.
    """
    unknowns = (len(scheme.s.x) + len(scheme.s.u)) * (1 + len(scheme.s.stages))
    steps = max(LEAST, ROWS // max(1, unknowns // 2))
    if not scheme.rule.is_formula:
        steps = min(steps, getattr(scheme.rule, "long_run", steps) // OF_PROGRAM)
    if steps < (ORDER + 2 * NEARBY):
        return []
    step = Fraction(scheme.scene.duration) / steps
    try:
        run = scheme.flow(step, 16).trajectory(steps)
    except DiscmechError:
        return []
    rows = np.hstack([np.asarray(part, dtype=float) for part in (run.x, run.mu)])
    sizes = np.abs(rows).max(axis=0)
    if not np.isfinite(rows).all() or not sizes.any():
        return []
    rows, unit = rows / np.where(sizes > 0, sizes, 1), scheme.rule.unit(16)
    best: list[tuple[float, int]] = []
    apart = 1
    while apart <= WIDEST and (ORDER + 2 * NEARBY) * apart < len(rows):
        best += _peaks(rows, apart, unit)
        apart *= 2
    chosen: list[int] = []
    for _, row in sorted(best, reverse=True):
        if len(chosen) < MOST and all(abs(row - other) > 2 * ORDER for other in chosen):
            chosen.append(row)
    return [row * step for row in chosen]


def _peaks(rows: Matrix, apart: int, unit: float) -> list[tuple[float, int]]:
    """Return (how far it stands out, its row) of the largest differences over rows so far apart."""
    signs = [(-1) ** j * comb(ORDER, j) for j in range(ORDER + 1)]
    count = len(rows) - ORDER * apart
    of: Vector = np.abs(
        sum(c * rows[j * apart : j * apart + count] for j, c in enumerate(signs))
    ).max(axis=1)
    noise = ROUND_OFFS * unit * np.sqrt(comb(2 * ORDER, ORDER) * (1 + apart))
    among = maximum_filter1d(of, ORDER * apart)[:: ORDER * apart // 2 or 1]
    usual = median_filter(among, NEARBY, mode="nearest")
    score = among / (STANDS_OUT * usual + noise)
    found = []
    for k in np.argsort(score)[: -MOST - 1 : -1]:
        if score[k] > 1:
            near = int(k) * (ORDER * apart // 2 or 1)
            lo = max(0, near - ORDER * apart // 2)
            peak = lo + int(of[lo : near + ORDER * apart // 2 + 1].argmax())
            found.append((float(score[k]), peak + ORDER * apart // 2))
    return found
