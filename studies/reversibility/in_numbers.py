"""A step back after a program's step forth, at places that it cannot know."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np

from discmech.integrators import StepFailure
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.extensions.foreign import derivative, guarded, noise_of
from discmech.integrators.extensions.foreign.differences import FARTHEST

from ..core.case import Case
from ..symplecticity.in_numbers import decisive, embedded, free_states, left_by, undecided
from ..symplecticity.places import looks, more_looks
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
    found, scale, seed = looks(case.scheme)
    rows: list[OfReturn] = []
    first = [(k, look) for k, look in enumerate(found) if look.count == 1]
    rule: Any = case.rule
    if rule.remembers or rule.runs:  # a run need not be its steps: a long one goes back
        k, look = next((k, look) for k, look in enumerate(found) if look.count > 1)
        first.append((k, replace(look, count=LONG)))
    further = enumerate(more_looks(case.scheme, scale, seed), len(found))
    for k, look in itertools.chain(first, further):
        if k >= len(found) and not undecided(case, rows):
            break
        row = OfReturn(float(look.step), k, float(look.time), count=look.count)
        try:
            rows.append(_returned(row, case, look, scale, seed + k))
        except StepFailure as failure:
            rows.append(replace(row, why_not=failure.cause))
    defects = [(row.defect, row.certain) for row in rows
               if row.defect is not None and row.certain is not None]  # fmt: skip
    if not defects:
        return FoundOfNumbers(rows)
    last, (defect, certain) = decisive(rows), map(max, zip(*defects, strict=True))
    return FoundOfNumbers(rows, last.left, Measured(defect, certain, last.resolution))


def _returned(row: OfReturn, case: Case, look: Any, scale: Any, seed: int) -> OfReturn:
    scheme: Any = case.scheme
    size, after, count = len(look.z), look.time + look.count * look.step, look.count
    forth = scheme.flow(look.step).map_of(count, t0=look.time)
    image = forth(look.z)
    try:
        back = scheme.flow(-look.step).map_of(count, t0=after)
        back(image)
    except (StepFailure, CannotMeasure):
        if not _even(scheme, look):
            raise
        turned = np.concatenate([np.ones(scheme.s.n), -np.ones(size - scheme.s.n)])
        again = scheme.flow(look.step).map_of(count)

        def back(z: Any) -> Any:
            return turned * again(turned * z)

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
    gap = np.abs(back(image) - look.z)
    return replace(
        row, defect=float((gap / scale).max()),
        certain=float((np.maximum(gap - error, 0) / scale).max()),
        resolution=float((error / scale).max()), left=left_by(case, look),
    )  # fmt: skip


def _even(scheme: Any, look: Any) -> bool:
    """True if reversed momenta reverse the motion: H(q, −p) = H(q, p), and no force."""
    if not scheme.scene.groupoid.canonical or scheme.scene.clocked:
        return False
    system, n = scheme.flow(look.step).system, scheme.s.n
    values = [system.H(look.z[:n], sign * look.z[n:]) for sign in (1, -1)]
    return bool(abs(values[0] - values[1]) <= 2.0**-40 * (1 + abs(values[0])))
