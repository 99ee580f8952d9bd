"""Places from which a map of numbers is judged: those of the evidence, with long enough steps."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators.extensions.foreign import MapOfRows, guarded, images
from discmech.integrators.numbers import Matrix, Vector

from ..evidence import evidence_of
from ..evidence.cloud import in_box
from ..evidence.places import random_fraction, seed_in_numbers

ENDS = 12  # number of times along a constrained motion
ROWS = 400  # the largest number of steps of the motion
#: the longest step from a place, in radians of the fastest motion there
FAST = 0.5, 1.0
SHARES = 0.0, 0.1, 0.2, 0.3  # shares of the motion's size by which places in numbers lie beside it
# steps of a run that is judged as one map: a fault that one step hides may lie between them
MORE = 3
IN_BOX, TRIES = 6, 32  # number of states of a box, and of draws of one from which a run stays in it


@dataclass(frozen=True)
class Look:
    """A state z = (x, μ), a time and a step (exact), how many of them, and the rate ‖∂f/∂z‖."""

    z: Vector
    time: Fraction
    step: Fraction
    count: int
    rate: float


def looks(scheme: Any) -> tuple[list[Look], Vector, int]:
    """Return two looks at each place of the evidence, the size of each entry of z, and the seed.

    Steps are those of the place and one radian of the fastest motion: long steps tell more, and the
    stability of a run of them does not concern the form.
    """
    if in_box(scheme):
        return _looks_in_box(scheme)
    scale, own = scale_of(scheme), Fraction(scheme.scene.step)
    all_looks: list[Look] = []
    if scheme.scene.in_numbers:
        seed = seed_in_numbers(scheme)
        drawn = random.Random(seed)
        for z, time, fast in _states(scheme, scale, drawn, SHARES):
            all_looks += _both(scheme, drawn, z, time, own * random_fraction(drawn, 0.6, 1.7), fast)
        return all_looks, scale, seed
    evidence = evidence_of(scheme)
    drawn, system = random.Random(evidence.seed + 2), scheme.flow(own).system
    for place in evidence.places:
        z = np.array([float(e) for e in (*place.x, *place.mu)])
        fast = rate(system, z, scale, float(place.t))
        step = min(place.step, own * random_fraction(drawn, 0.6, 1.7))
        all_looks += _both(scheme, drawn, z, place.t, step, fast)
    return all_looks, scale, evidence.seed


def _both(
    scheme: Any, drawn: random.Random, z: Vector, time: Fraction, own: Fraction, fast: float
) -> list[Look]:
    """Return looks at some steps of that size and at a long one; a map has its one step alone."""
    longest = Fraction(1 / fast) if 0 < fast < math.inf else own
    steps = [own, max(own, longest * random_fraction(drawn, *FAST))]
    return [Look(z, time, scheme.rule.step_for(step), count, fast)
            for step, count in zip(steps, (MORE, 1), strict=True)]  # fmt: skip


def _looks_in_box(scheme: Any) -> tuple[list[Look], Vector, int]:
    """Return looks at drawn states in the box of a map without a scene.

    The rate of its motion is unknown, so nothing less than the whole form counts as lost.
    """
    low, high = np.array(scheme.rule.states, dtype=float)
    seed, step = seed_in_numbers(scheme), Fraction(scheme.scene.step)
    drawn, all_looks = random.Random(seed), list[Look]()
    stays = map_of(scheme.flow(step), MORE)
    for _ in range(IN_BOX):
        for _ in range(TRIES):
            z = low + (high - low) * np.array([drawn.random() for _ in low])
            if inside := bool(np.isfinite(stays(z)).all()):
                break
        looks = _both(scheme, drawn, z, Fraction(0), step, math.inf)
        all_looks += looks if inside else looks[1:]
    return all_looks, scale_of(scheme), seed


def map_of(flow: Any, count: int, t0: Any = 0, rows: int = 1) -> Any:
    """Return `flow.map_of`; in a map's box its image is no number where a step begins outside.

    Outside nothing is claimed. Of one step from a state in the box a failure is raised.
    """
    if not in_box(flow.scheme):
        return flow.map_of(count, t0=t0, rows=rows)
    one, (low, high) = flow.map_of(1), np.array(flow.scheme.rule.states, dtype=float)
    step = guarded(one, len(low))

    def all_rows(z: Matrix) -> Matrix:
        made = list[Matrix]()
        for k in range(1, count + 1):
            inside = ((low <= z) & (z <= high)).all(axis=1)
            after = np.full_like(z, np.nan)
            if inside.any():
                after[inside] = images(one if count == len(z) == 1 else step, z[inside])
            z = after
            made += [z] if k % (count // rows) == 0 else []
        return np.hstack(made)

    return MapOfRows(lambda z: all_rows(z[None])[0], all_rows)


def more_looks(scheme: Any, scale: Vector, seed: int) -> Iterator[Look]:
    """Yield further places, one long step from each: beside rows of the motion, by `SHARES`.

    They are for scenes whose first places tell too little, as near a pole, where all steps are
    short.
    """
    if scheme.scene.all_constraints or in_box(scheme):
        return
    drawn = random.Random(seed + 3)
    for z, time, fast in _states(scheme, scale, drawn, SHARES * 2):
        if 0 < fast < math.inf:
            step = Fraction(1 / fast) * random_fraction(drawn, *FAST)
            yield Look(z, time, scheme.rule.step_for(step), 1, fast)


def _states(
    scheme: Any, scale: Vector, drawn: random.Random, shares: Sequence[float]
) -> Iterator[tuple[Vector, Fraction, float]]:
    """Yield (state, time, rate) of drawn rows of the motion, and beside them by those shares."""
    rows, own = motion_of(scheme), Fraction(scheme.scene.step)
    system = scheme.flow(own).system
    for share in shares:
        at = drawn.randrange(len(rows))
        signs = [drawn.choice((-1, 1)) * drawn.uniform(0.5, 1) for _ in scale]
        z = rows[at] + share * scale * np.array(signs)
        yield z, at * own, rate(system, z, scale, float(at * own))


def scale_of(scheme: Any) -> Vector:
    """Return how far each entry of (x, μ) moves, along a motion not made by the black box."""
    if in_box(scheme):
        low, high = np.array(scheme.rule.states, dtype=float)
        return np.asarray((high - low) / 2)
    rows = motion_of(scheme)
    n = scheme.s.n
    reach, size = np.ptp(rows, axis=0), np.abs(rows).max(axis=0)
    # an entry that hardly moves has the size of its value, or of its kind
    parts = (slice(0, n), slice(n, None))
    like = np.concatenate([np.full(len(size[p]), size[p].max(initial=0.0)) for p in parts])
    scale = np.where(reach > 1e-3 * size, reach, size)
    scale = np.where(scale > 1e-9 * like, scale, like)
    return np.where(scale > 0, scale, 1.0)


def motion_of(scheme: Any) -> Matrix:
    """Return rows of the scene's motion, by a Runge–Kutta method on its field.

    Under constraints they are those of its reference.
    """
    if scheme.scene.all_constraints:
        times = [scheme.scene.duration * k / ENDS for k in range(ENDS + 1)]
        solutions = [reference.solution(scheme.scene, t, digits=20, proof=False) for t in times]
        return np.array([[float(e) for e in (*at.x, *at.mu)] for at in solutions])
    flow, scene = scheme.flow(scheme.scene.step), scheme.scene
    system, run = flow.system, flow.trajectory(0)
    n, h = system.n, float(scene.step)
    z = np.concatenate([run.x[0], run.mu[0]]).astype(float)
    rows, time = [z], 0.0

    def f(z: Vector, t: float) -> Vector:
        return np.concatenate(system.f(z[:n], z[n:], t)).astype(float)

    for _ in range(min(ROWS, scene.steps_for(scene.step))):
        a = f(z, time)
        b = f(z + h / 2 * a, time + h / 2)
        c = f(z + h / 2 * b, time + h / 2)
        z = z + h / 6 * (a + 2 * b + 2 * c + f(z + h * c, time + h))
        if not np.isfinite(z).all():
            break
        time += h
        rows.append(z)
    return np.array(rows)


def rate(system: Any, z: Vector, scale: Vector, time: float) -> float:
    """Return ‖∂f/∂z‖₂ at z in units of the scale, by differences: an inverse time of the motion."""
    n = system.n
    columns = []
    for j, d in enumerate(scale):
        way = np.zeros(len(z))
        way[j] = 1e-4 * d
        ends = [np.concatenate(system.f(a[:n], a[n:], time)) for a in (z + way, z - way)]
        columns.append((ends[0] - ends[1]) / 2e-4)
    matrix = np.array(columns, dtype=float).T / scale[:, None]
    return float(np.linalg.norm(matrix, 2)) if np.isfinite(matrix).all() else math.inf
