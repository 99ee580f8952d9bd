"""Many ordinary steps in doubles, all along the motion, which show where a law is to be asked.

A fault in a thousandth of the motion lies between a few places, and one of a high power of the step
does not show in a run of short steps (`scan`). So steps of all sizes (`cloud`), forth and back in
time, are made from rows of such a run. Where steps are unlike those beside them (`unlike_steps`),
every law is asked.
"""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators.errors import DiscmechError
from discmech.integrators.numbers import Matrix, Vector

from .cloud import (
    LONGEST,
    LOOKED_AT,
    OCTAVES,
    AnyScheme,
    Cloud,
    costs_of_call,
    sizes_of,
)
from .places import SHARES, Place, seed_in_numbers
from .scan import costs_of, highest, peaks_of, run_of, steps_of

#: rows of a run from which one step is made: four in a thousandth of the motion
ROWS = 2**12
BESIDE = 5  # one row of so many begins beside the motion
#: steps of one size all along the motion, and of sizes over `OCTAVES` and more from one state: four
#: in a thousandth of the motion, and three in a hundredth of a size
ALONG, OF_SIZES = 2**12, 2**11


@lru_cache(maxsize=8)
def unlike_steps(scheme: AnyScheme) -> list[Place]:
    """Return the starts of steps that are least like those beside them: none of a derived rule.

    The ends of steps of one size from rows along the motion are a smooth curve, and so are those of
    steps of all sizes from one row, but where the method does something else (`scan.peaks`). A
    derived rule has one formula everywhere, and a program is looked at in its own numbers.
    """
    rule, own = scheme.rule, float(scheme.scene.step)
    if not rule.is_formula or rule.asks_lagrangian:
        return []
    try:
        run = run_of(scheme, steps_of(scheme))
    except DiscmechError:
        return []
    drawn = np.random.default_rng(len(run.t))
    at = np.arange(0, len(run.t), max(1, len(run.t) * costs_of(scheme) // ALONG))  # evenly
    shares = np.geomspace(2.0**-OCTAVES, LONGEST, OF_SIZES // costs_of(scheme))
    one, part = np.full(len(shares), drawn.choice(at)), drawn.uniform(0.9, 1)
    places = []
    for rows, steps in ((at, np.full(len(at), own * part)), (one, own * shares)):
        cloud = _of_rows(scheme, run, rows, steps)
        known = np.flatnonzero(np.isfinite(cloud.ends).all(axis=1))
        peaks = peaks_of(cloud.ends[known], Fraction(1), rule.unit(16))
        places += [cloud.place(known[int(peak.time)]) for peak in highest(peaks, LOOKED_AT)]
    return places


@lru_cache(maxsize=8)
def many_steps(scheme: AnyScheme, fewer: int = 1) -> Cloud | None:
    """Return many steps of a scheme all along its motion; None where no run can be made.

    fewer: by so much fewer are made.
    """
    rule, seed = scheme.rule, seed_in_numbers(scheme)
    rows = ROWS // fewer // costs_of(scheme) // costs_of_call(rule)
    try:
        run = run_of(scheme, steps_of(scheme))
    except DiscmechError:
        return None
    at = np.linspace(0, len(run.t) - 2, min(rows, len(run.t) - 1)).astype(int)
    sizes = sizes_of(scheme, seed)
    steps = np.resize(sizes * (-1) ** np.arange(len(sizes)), len(at))
    cloud = _of_rows(scheme, run, at, steps)
    reach, starts = np.ptp(cloud.z, axis=0), cloud.z
    if scheme.scene.all_constraints or scheme.s.degenerate:
        reach[:] = 0
    elif not scheme.scene.groupoid.canonical:  # x may lie on an orbit, such as a sphere
        reach[: scheme.s.n] = 0
    drawn = np.random.default_rng(seed)
    starts[::BESIDE] += (reach * drawn.uniform(-SHARES[1], SHARES[1], starts.shape))[::BESIDE]
    cloud.beside[::BESIDE] = True
    if rule.own_coordinates:  # a run of many steps may leave a group
        flow = scheme.flow(scheme.scene.step)
        starts[:] = [flow.settled(z, Fraction(t)) for z, t in zip(starts, cloud.t, strict=True)]
    return cloud


def _of_rows(scheme: AnyScheme, run: Any, at: Vector, steps: Vector) -> Cloud:
    """Return those rows of a run, and a step from each."""
    z: Matrix = np.hstack([run.x, run.mu])[at].astype(float)
    times = float(run.step) * at
    return Cloud(scheme, z, np.asarray(run.u, float)[at], times, steps, np.full(len(at), False))
