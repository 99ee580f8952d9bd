"""Single steps of a program's run that are unlike those beside them, as at an event.

A step that stops where a velocity changes its sign, say, is as good as all others from any one
place, once it is short: the part of the motion where it is not is as narrow as a step. But each run
has such steps, as many however short they are, and what one of them errs by is left at the end. So
the power of h in the largest of them, a whole number, is the order of runs.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from discmech.integrators import DiscmechError, Scheme
from discmech.integrators.numbers import Matrix, Vector
from discmech.reference import ReferenceFailure, many_motions

from .order import ComponentOrder
from .places import places_at
from .rows import velocities
from .scan import LONGER, ORDER, STANDS_OUT, peaks, run_of, steps_of

#: rows of a run that are least smooth, and steps on either side of what they are made of
MOST, BESIDE = 8, 8
#: roundings of the state that an error has to be above, and so many errors of the reference
CLEAR = 100
#: the power of h may be so much less for where in a step the event is: drawn evenly over a step,
#: the largest of a few is seldom 16^(3/4) = 8 times another such
LESS = 0.75
#: shares of the number of long steps, whose runs meet an event at other parts of a step
SHARES = (1, 0.87, 0.77, 0.69)
UNLIKE = "in a step of a run that is unlike those beside it"


def isolated(scheme: Scheme) -> ComponentOrder | None:
    """Return the order of runs by their unlike steps; None without one, or where it is no lower.

    None also for systems whose own motion has events, and where the motion is not smooth.
    """
    if not scheme.scene.is_smooth or not scheme.rule.repeats:
        return None
    if (short := _largest(scheme, count := steps_of(scheme))) is None:
        return None
    for longer in (LONGER, math.isqrt(LONGER)):  # in long steps the method's own error hides more
        runs = (_largest(scheme, int(count / longer * share)) for share in SHARES)
        seen = [each for each in runs if each]
        if seen:
            long = max(seen, key=lambda each: each[0] / each[1])
            order = math.log(long[0] / short[0]) / math.log(long[1] / short[1])
            if order > (scheme.order or 1) - LESS or not (at := places_at(scheme, [short[3]])):
                return None
            return ComponentOrder(f"{short[2]} {UNLIKE}", float(round(order)), None, at[0])
    return None


def _largest(scheme: Any, count: int) -> tuple[float, float, str, Any] | None:
    """Return (the largest error of an unlike step in a run of so many, the step, the component, the
    time).
    """
    if count < ORDER + 2 * BESIDE:
        return None
    try:
        run = run_of(scheme, count)
        rows = np.hstack([run.x, run.mu]).astype(float)
        scale = np.abs(rows).max(axis=0)
        least = sorted(peaks(rows / np.where(scale, scale, 1), 1, scheme.rule.unit(16)))[-MOST:]
        worst = (0.0, 0, 0)
        for _, row in least:
            at = np.arange(max(0, row - ORDER - BESIDE), min(count, row + ORDER + BESIDE))
            off, error = errors_of_steps(scheme, run, at)
            size = off.max(axis=1)
            known = CLEAR * (scheme.rule.unit(16) + error.max(axis=1))
            unlike = (size > STANDS_OUT * np.quantile(size, 0.25)) & (size > known)
            for k in np.flatnonzero(unlike):
                worst = max(worst, (float(size[k]), int(at[k]), int(off[k].argmax())))
    except (DiscmechError, ReferenceFailure):
        return None
    if not worst[0]:
        return None
    return worst[0], float(run.step), name_of(worst[2], run), worst[1] * run.step


def errors_of_steps(scheme: Any, run: Any, at: Vector) -> tuple[Matrix, Matrix]:
    """Return how far the steps from rows `at` (r,) of a run end from the motion, (r, k), and how
    far the motion is known, both over the largest of each component in the run.

    Raises `ReferenceFailure` for a scene that can have no reference.
    """
    x, mu, v = (np.asarray(e, dtype=float) for e in (run.x, run.mu, velocities(scheme, run)))
    h, rows, by = float(run.step), np.hstack([x, mu]), np.ones(x.shape[1] + v.shape[1])
    ends = many_motions(scheme.scene).after(x[at], v[at], h * at, np.full(len(at), h), by)
    scale = np.abs(rows).max(axis=0)
    scale = np.where(scale, scale, 1)
    return np.abs(rows[at + 1] - np.hstack([ends.x, ends.mu])) / scale, ends.error / scale


def name_of(entry: int, run: Any) -> str:
    """Return the name of a component of (x, μ)."""
    n = np.shape(run.x)[1]
    return f"x[{entry}]" if entry < n else f"mu[{entry - n}]"
