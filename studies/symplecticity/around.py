"""The form at many states around the motion, or in a box, by plain differences: where to look.

A few places do not meet a part of the states, or of the sizes of steps, in which a program loses
the form, or gives a wrong derivative. So both are computed at all states of a `cloud`, by
differences of order 4 with one width, which have no bound. They judge nothing: where they stand
out, steps are looked at as elsewhere.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from discmech.integrators.extensions.foreign import Derivative
from discmech.integrators.numbers import Matrix, Vector
from discmech.reference import ReferenceFailure, many_motions

from ..core.case import Case
from ..core.claims import not_claimed
from ..evidence.cloud import LOOKED_AT, around, ends_of, in_box
from ..evidence.places import sizes_of_motion
from .form_in_numbers import form_gaps
from .own_derivatives import asked_jacobian, distance
from .places import Look, rate

WIDTH = 2.0**-9  # of differences, over the size of the motion: they err by its fourth power
#: weights of f(z + iw) over w
WEIGHTS = {0: 0.0, 1: 2 / 3, -1: -2 / 3, 2: -1 / 12, -2: 1 / 12}
#: times the usual: what differences err by is of the motion, and grows by less in most of it
STANDS_OUT = 100
#: a width so much smaller leaves a part of 256 of what differences err by, and a fault as it is
FINER = 4


def conspicuous(case: Case, scale: Vector, fewer: int = 1) -> tuple[list[Look], int]:
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
    try:
        states, steps = (part[::fewer] for part in _steps(scheme))
    except ReferenceFailure:
        return [], 0
    scores = _scores(scheme, states, steps, scale, WIDTH)
    chosen: set[int] = set()
    for j, (score, usual) in enumerate(zip(scores.T, _usual(scores, steps).T, strict=True)):
        over = score / (STANDS_OUT * np.where(usual > 0, usual, 2.0**-1000))
        rows = np.argsort(-over)[: FINER * LOOKED_AT]
        rows = rows[over[rows] > 1]
        again = _scores(scheme, states[rows], steps[rows], scale, WIDTH / FINER)[:, j]
        chosen |= {int(k) for k in rows[2 * again > score[rows]][:LOOKED_AT]}
    system = scheme.flow(scheme.scene.step).system
    return [Look(states[k], Fraction(0), rule.step_for(Fraction(steps[k])), 1,
                 np.inf if in_box(scheme) else rate(system, states[k], scale, 0.0))
            for k in sorted(chosen)], len(states)  # fmt: skip


def _steps(scheme: Any) -> tuple[Matrix, Vector]:
    """Return the states of a cloud and its steps, halved where the motion is fast."""
    cloud = around(scheme)
    if not scheme.rule.follows_motion:
        return cloud.z, cloud.steps
    by = sizes_of_motion(scheme.scene)
    fast = many_motions(scheme.scene).rates(cloud.z[:, : scheme.s.n], cloud.v, cloud.t, by)
    with np.errstate(all="ignore"):
        halvings = np.ceil(np.log2(fast * cloud.steps))
    return cloud.z, cloud.steps / 2 ** np.clip(np.nan_to_num(halvings), 0, 60)


def _usual(scores: Matrix, steps: Vector) -> Matrix:
    """Return the median score over half of all steps, those of the nearest sizes."""
    from scipy.ndimage import median_filter

    if not np.ptp(steps):
        return np.median(scores, axis=0) + 0 * scores
    order, usual = np.argsort(steps), np.empty_like(scores)
    usual[order] = median_filter(scores[order], (len(steps) // 2, 1), mode="nearest")
    return usual


def _scores(scheme: Any, starts: Matrix, steps: Vector, scale: Vector, width: float) -> Matrix:
    """Return the defects of form and volume of each step, and those of its own derivative, (r, k).

    A state from which a step fails has none.
    """
    size, ways = len(scale), [i * way for way in np.diag(width * scale) for i in WEIGHTS]
    states = (starts + np.array(ways)[:, None]).reshape(-1, size)
    ends = ends_of(scheme, states, np.zeros(len(states)), np.tile(steps, len(ways)))
    ends = ends.reshape(size, len(WEIGHTS), len(starts), size)
    after, weights = ends[0, 0], np.array(list(WEIGHTS.values()))
    slopes = np.einsum("i,jirk->rkj", weights, ends) / (width * scale)
    scores = np.zeros((len(starts), 4 if scheme.rule.jacobian else 2))
    (known,) = np.nonzero(np.isfinite(slopes).all(axis=(1, 2)) & np.isfinite(after).all(axis=1))
    of, starts, steps = slopes[known], starts[known], steps[known]
    system, n = scheme.flow(scheme.scene.step).system, scheme.s.n
    tensors = [
        np.moveaxis(system.tensor(*np.split(e.T, [n])), -1, 0) for e in (starts, after[known])
    ]
    scores[known, 0] = form_gaps(of, *tensors)
    scores[known, 1] = np.abs(np.abs(np.linalg.det(of)) - 1)
    if scheme.rule.jacobian:
        flows = [scheme.flow(scheme.rule.step_for(Fraction(step))) for step in steps]
        own = np.array([asked_jacobian(*one) for one in zip(flows, starts, strict=True)])
        scores[known, 2] = form_gaps(own.reshape(of.shape), *tensors)
        scores[known, 3] = [distance(a, Derivative(b, 0 * b), scale, scale, 0.0)[0]
                            for a, b in zip(own, of, strict=True)]  # fmt: skip
    return np.nan_to_num(scores, posinf=1.0)
