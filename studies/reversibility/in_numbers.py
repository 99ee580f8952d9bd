"""A step back after a program's step forth, at places that it cannot know."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np

from discmech.integrators import StepFailure
from discmech.integrators.extensions.foreign import derivative, guarded, noise_of
from discmech.integrators.extensions.foreign.differences import FARTHEST
from discmech.integrators.numbers import Vector

from ..core.case import Case
from ..evidence.cloud import Map, in_box, way_back
from ..evidence.laws import WAY_BACK
from ..evidence.many_steps import many_steps
from ..evidence.places import Place
from ..symplecticity.in_numbers import decisive, embedded, free_states, left_by, undecided
from ..symplecticity.judging_form import rounded
from ..symplecticity.places import Look, looks, more_looks
from .records import FoundOfNumbers, Measured, OfReturn

#: factor for a program's change of its argument beside its result: the rounded state in between
ROUNDED = 4
#: steps forth, and then back, of a program that keeps something from step to step
LONG = 256


def measure(case: Case) -> FoundOfNumbers:
    """Return rows of steps forth and back, and the resolution that `ENOUGH` places reach.

    If the program takes no negative step and H is even in the momentum, the step back is one forth
    with reversed momenta.
    """
    all_looks, scale, seed = looks(case.scheme)
    rows: list[OfReturn] = []
    first = [look for look in all_looks if look.count == 1]
    rule: Any = case.rule
    if not rule.repeats:  # a run need not be its steps: a long one goes back
        first.append(replace(next(look for look in all_looks if look.count > 1), count=LONG))
    seen, asked = _seen(case)
    first += [Look(np.array([float(e) for e in (*place.x, *place.mu)]), place.t, place.step, 1,
                   first[0].rate) for place in seen]  # fmt: skip
    further = more_looks(case.scheme, scale, seed)
    for k, look in enumerate(itertools.chain(first, further)):
        if k >= len(first) and not undecided(case, rows):
            break
        row = OfReturn(float(look.step), k, float(look.time), count=look.count)
        try:
            rows.append(_returned(row, case, look, scale, seed + k))
        except StepFailure as failure:
            rows.append(replace(row, why_not=failure.cause))
    defects = [(row.defect, row.certain) for row in rows
               if row.defect is not None and row.certain is not None]  # fmt: skip
    if not defects:
        return FoundOfNumbers(rows, asked=asked)
    last, (defect, certain) = decisive(case, rows), map(max, zip(*defects, strict=True))
    return FoundOfNumbers(rows, last.left, Measured(defect, certain, last.resolution), asked)


def _seen(case: Case) -> tuple[list[Place], int]:
    """Return (starts of steps, of many along the motion, that a step back misses, how many)."""
    if (many := many_steps(case.scheme)) is None:
        return [], 0
    gaps = WAY_BACK.gaps(many)
    return many.places(gaps, rounded(case.rule.unit(16))), int(np.isfinite(gaps).sum())


def _turns(forth: Map, z: Vector, image: Vector, gap: Vector, n: int) -> Vector:
    """Return the whole turns in a gap of angles: coordinates of which a map forgets the turns."""
    turns = 2 * np.pi * np.round(gap / (2 * np.pi)) * (np.arange(len(z)) < n)
    for i in np.flatnonzero(turns):
        if np.abs(forth(z + 2 * np.pi * (np.arange(len(z)) == i)) - image).max() > 1:
            turns[i] = 0  # a turn farther it goes somewhere else
    return turns


def _returned(row: OfReturn, case: Case, look: Any, scale: Any, seed: int) -> OfReturn:
    scheme: Any = case.scheme
    size, after, count = len(look.z), look.time + look.count * look.step, look.count
    forth = scheme.flow(look.step).map_of(count, t0=look.time)
    image = forth(look.z)
    back = way_back(scheme, look.step, count, after, image)
    unit = case.rule.unit(16)
    noises, system = [], scheme.flow(look.step).system
    for f, z in ((forth, look.z), (back, image)):
        embed, reach = free_states(case, system, z, scale)
        g = guarded(embedded(case, f, z, embed), size)
        noises.append(noise_of(g, 0 * reach, reach, unit, seed))
    of = derivative(g, size, reach, noises[1])
    start = derivative(embed, size, reach, noise_of(embed, 0 * reach, reach, 2.0**-53))
    amplified = (np.abs(of.value) + of.error) @ np.abs(np.linalg.pinv(start.value))
    rough = [FARTHEST * n.level + n.jump for n in noises]
    rough[0] = rough[0] + ROUNDED * unit * np.abs(image)
    error = amplified @ rough[0] + rough[1] + ROUNDED * unit * np.abs(look.z)
    gap = back(image) - look.z
    if in_box(case):
        gap -= _turns(forth, look.z, image, gap, system.n)
    gap = np.abs(gap)
    certain = np.maximum(gap - error, 0) / scale
    worst, n = int(np.argmax(certain)), system.n
    return replace(
        row, defect=float((gap / scale).max()), certain=float(certain[worst]),
        resolution=float((error / scale).max()), left=left_by(case, look),
        entry=f"x[{worst}]" if worst < n else f"mu[{worst - n}]",
    )  # fmt: skip
