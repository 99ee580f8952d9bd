"""Short steps of a program from many states around the motion, which show where it is to be judged.

A program may do something else in a part of the states that the scene's motion does not visit, and
that a few places do not meet. So steps of three sizes are made from the states of a `cloud`, and
their errors, against the exact motion from there, have to sink as the order has it. They judge
nothing: where they do not, the single steps are judged as from all other places.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators.errors import DiscmechError, Displaced
from discmech.integrators.numbers import Matrix, Vector
from discmech.reference import ReferenceFailure, many_motions

from .cloud import LOOKED_AT, Cloud, around, ends_of
from .places import Place, places_from, sizes_of_motion

#: round-offs that a step of the expected order leaves, in units of the motion's own rate: of a
#: lower order by a millionth of the motion it leaves more
SMALL = 2**20
RATIO = 8  # of two steps: half a power of it is a factor of 2.8
#: the second and the third step show an event, which a longer one alone meets, to be none of these
PARTS = 1, RATIO, RATIO**2
CLEAR, ROUNDED = 100, 8  # an error of so many roundings is none, each of so many round-offs


@lru_cache(maxsize=64)
def states_that_stand_out(scheme: Any) -> tuple[list[Place], int, tuple[float, ...]]:
    """Return (the states from which short steps miss the order most, how many were asked, the least
    and the largest step over the scene's).

    A derived rule has one formula everywhere, which few places judge. Not where states are bound by
    constraints or contact, and not on scenes in numbers, whose tables have knots.
    """
    rule, scene = scheme.rule, scheme.scene
    if not scene.is_smooth or not rule.follows_motion or rule.asks_lagrangian:
        return [], 0, ()
    try:
        cloud = around(scheme)
        missed, known, sizes = _missed(cloud)
    except Displaced:
        raise
    except (DiscmechError, ReferenceFailure):
        return [], 0, ()
    worst = [int(k) for k in np.argsort(-missed)[:LOOKED_AT] if missed[k] > 0]
    return places_from(scheme, cloud, worst), known, sizes


def _missed(cloud: Cloud) -> tuple[Vector, int, tuple[float, ...]]:
    """Return (the errors of steps that miss the order, (r,), else 0; how many steps are known, the
    least and the largest of all over the scene's).
    """
    scheme, starts, t, v = cloud.scheme, cloud.z, cloud.t, cloud.v
    rule, motions, by = scheme.rule, many_motions(scheme.scene), sizes_of_motion(scheme.scene)
    order, unit, x = scheme.order or 1, rule.unit(16), starts[:, : scheme.s.n]
    rates = motions.rates(x, v, t, np.where(by > 0, by, 1))
    with np.errstate(all="ignore"):
        steps = np.minimum((SMALL * unit) ** (1 / (order + 1)) / rates, float(scheme.scene.step))
        steps = 2.0 ** np.floor(np.log2(steps))
    steps = np.where(np.isfinite(steps) & (steps > 0), steps, float(scheme.scene.step))
    scale = np.abs(starts).max(axis=0)
    errors = list[Matrix]()
    for part in PARTS:
        ends = motions.after(x, v, t, steps / part, by)
        made = ends_of(scheme, starts, t, steps / part)
        errors.append(np.abs(made - np.hstack([ends.x, ends.mu])))
    rounding = ROUNDED * unit * np.maximum(scale, np.abs(starts)) + ends.error
    # a method with memory starts in its own way, in a first step of one order less
    least = float(RATIO) ** (order + rule.repeats - 0.5)
    low = (errors[0] < least * errors[1]) & (errors[1] < least * errors[2])
    missed = np.where(low & (errors[2] > CLEAR * rounding), errors[2], 0)
    known = np.isfinite(np.sum(errors, axis=0) + rounding).all(axis=1)
    missed = np.nan_to_num((missed / np.where(scale > 0, scale, 1)).max(axis=1))
    shares = steps / float(scheme.scene.step)
    return missed, int(known.sum()), (float(shares.min()) / PARTS[-1], float(shares.max()))
