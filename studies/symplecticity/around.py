"""The form at many states around the motion, or in a box, by plain differences: where to look.

A few places do not meet a part of the states in which a program loses the form, or gives a wrong
derivative. So both are computed at many drawn states, by differences of order 4 with one width,
which have no bound. They judge nothing: where they stand out, steps are looked at as elsewhere.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators.extensions.foreign import Derivative, guarded, images
from discmech.integrators.numbers import Matrix, Vector

from ..core.case import Case
from ..core.claims import not_claimed
from ..evidence.around import COUNT, OF_LONG_RUN, OF_RUNS
from ..evidence.places import WIDE, random_fraction
from .form_in_numbers import form_defect, volume_defect
from .own_derivatives import asked_jacobian, distance
from .places import Look, in_box, motion_of, rate

#: states of a box, which is all that its map is judged by: four in a thousandth of it
IN_BOX = 2**12
WIDTH = 2.0**-9  # of differences, over the size of the motion: they err by its fourth power
#: weights of f(z + iw) − f(z − iw), over w
WEIGHTS = {1: 2 / 3, 2: -1 / 12}
#: times the median: what differences err by is of the motion, and grows by less in most of it
STANDS_OUT = 100
#: a width so much smaller leaves a part of 256 of what differences err by, and a fault as it is
FINER = 4
LOOKED_AT = 3  # states that stand out most
SIZES = 2**8  # of steps: two or three in a hundredth of a size, over the range that is drawn


def conspicuous(case: Case, scale: Vector, seed: int, fewer: int = 1) -> tuple[list[Look], int]:
    """Return (the steps whose form, volume or own derivative stands out, how many were asked).

    fewer: by so much fewer are asked.

    None is asked where nothing of it is claimed, and none under constraints and of attitudes, whose
    states beside the motion are none.
    """
    rule: Any = case.rule
    scheme = case.scheme
    claimed = not (not_claimed(rule, "symplectic") and not_claimed(rule, "volume"))
    bound = case.scene.all_constraints or case.scene.timed or rule.own_coordinates
    if bound or rule.remembers or not (claimed or rule.jacobian):
        return [], 0
    looks = _looks(scheme, scale, seed, fewer)
    scores = _scores(scheme, looks, scale, WIDTH)
    chosen: set[int] = set()
    for j, score in enumerate(scores.T):
        rows = np.argsort(-score)[: FINER * LOOKED_AT]
        rows = rows[score[rows] > STANDS_OUT * np.median(score)]
        again = _scores(scheme, [looks[k] for k in rows], scale, WIDTH / FINER)[:, j]
        chosen |= {int(k) for k in rows[2 * again > score[rows]][:LOOKED_AT]}
    return [looks[k] for k in sorted(chosen)], len(looks)


def _looks(scheme: Any, scale: Vector, seed: int, fewer: int) -> list[Look]:
    """Return steps from drawn states: of `SIZES` sizes, halved where the motion is fast."""
    drawn, random_of = np.random.default_rng(seed), random.Random(seed)
    only, own = scheme.rule.only_step, Fraction(scheme.scene.step)
    if in_box(scheme):
        low, high = (np.array([float(e) for e in end]) for end in scheme.rule.states)
        starts = drawn.uniform(low, high, (IN_BOX, len(low)))
    else:
        rows = motion_of(scheme)
        count = min(COUNT // fewer // (OF_RUNS if scheme.rule.runs else 1),
                    scheme.rule.long_run // OF_LONG_RUN)  # fmt: skip
        sizes = scale.copy()
        if not scheme.scene.groupoid.canonical:
            sizes[: scheme.s.n] = 0
        wide = drawn.uniform(0, WIDE, (count, 1))
        starts = rows[drawn.integers(len(rows), size=count)]
        starts = starts + wide * sizes * drawn.uniform(-1, 1, starts.shape)
    if only is not None:
        return [Look(z, Fraction(0), only, 1, np.inf) for z in starts]
    system = scheme.flow(own).system
    sizes_of_steps = [own * random_fraction(random_of, 0.6, 1.7) for _ in range(SIZES)]
    looks = []
    for k, z in enumerate(starts):
        fast, step = rate(system, z, scale, 0.0), sizes_of_steps[k % SIZES]
        while np.isfinite(fast) and step * fast > 1:
            step /= 2
        looks.append(Look(z, Fraction(0), step, 1, fast))
    return looks


def _scores(scheme: Any, looks: Sequence[Look], scale: Vector, width: float) -> Matrix:
    """Return the defects of form and volume of each step, and those of its own derivative, (r, k).

    A state from which a step fails has none.
    """
    scores = np.zeros((len(looks), 4 if scheme.rule.jacobian else 2))
    for step in {look.step for look in looks}:
        rows = [k for k, look in enumerate(looks) if look.step == step]
        flow, starts = scheme.flow(step), np.array([looks[k].z for k in rows])
        f = guarded(flow.map_of(1), len(scale))
        slopes = np.zeros((*starts.shape, len(scale)))
        for j, way in enumerate(np.diag(scale)):
            for i, weight in WEIGHTS.items():
                ends = [images(f, starts + sign * i * width * way) for sign in (1, -1)]
                slopes[:, :, j] += weight * (ends[0] - ends[1]) / (width * scale[j])
        for k, z, after, slope in zip(rows, starts, images(f, starts), slopes, strict=True):
            if np.isfinite(slope).all() and np.isfinite(after).all():
                scores[k] = _defects(flow, z, after, Derivative(slope, 0 * slope), scale)
    return np.nan_to_num(scores, posinf=1.0)


def _defects(flow: Any, z: Vector, after: Vector, of: Derivative, scale: Vector) -> list[float]:
    """Return the defects of one step, of its form, its volume, and of its own derivative."""
    n = flow.system.n
    tensors = [flow.system.tensor(e[:n], e[n:]) for e in (z, after)]
    defects = [form_defect(of, *tensors).measured, volume_defect(of).measured]
    if flow.scheme.rule.jacobian:
        own = asked_jacobian(flow, z)
        defects += [form_defect(Derivative(own, 0 * own), *tensors).measured,
                    distance(own, of, scale, scale, 0.0)[0]]  # fmt: skip
    return defects
