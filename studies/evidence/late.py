"""Steps late in a program's run, which may be others if it counts them.

What each 4096th step does lies in no short run. A function of the state that keeps nothing from one
step to the next cannot count; of any other the steps of a long run are made again, in another
order. Whether it keeps something is seen in 3 steps from the scene's start, of a step of about the
scene's: not what it keeps elsewhere, for shorter steps alone, or in the class of the scene in
numbers. A class with a memory and a program of whole runs count by right. What they do at one
number of steps shows in runs from other states too, at the same row of each; a count of the steps
in a part of the motion does not.
"""

from __future__ import annotations

import math
from contextlib import suppress
from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from discmech.integrators.errors import DiscmechError, StepFailure
from discmech.integrators.extensions.foreign import SceneInNumbers
from discmech.integrators.numbers import Matrix, Vector, arithmetic
from discmech.integrators.scene import Opaque, reads

from ..core.limits import MADE_AGAIN
from ..core.single_steps import ALIKE, ROW, Departure
from .repeated import ends_alike, in_another_order
from .scan import NEARBY, peaks, run_of, steps_of

OTHER_STEP = Fraction(8137, 10007)  # of the scene's: none that is remembered from a study
#: where in a run the second and the third one begin, so that they end with it: drawn shares
BEGIN = (0.05, 0.2), (0.2, 0.35)
#: rows in which runs of a program whose own steps are others, as by an interpolation, are unlike by
#: chance are no count: one program in so many would be told to count
RARE = 1e-5
WIDTH = 3  # rows in which a step that is unlike those beside it may show: its own and its two ends


@lru_cache(maxsize=8)
def late_steps(scheme: Any) -> Departure | None:
    """Return how far a long run of a program is its steps made again; asked: their number.

    None for what keeps nothing from one step to the next. `unknown` says why no long run could be
    made, with no number of steps, or what counts the steps of its runs by right.
    """
    rule = scheme.rule
    if rule.is_formula or rule.is_recorded:
        return None
    try:
        if not rule.repeats:
            return _of_count(scheme)
        if not keeps_something(scheme):
            return None
        run = run_of(scheme, steps_of(scheme))
        states = _states(run)
        flow, scale = scheme.flow(run.step), _sizes(states)
        if rule.own_coordinates:  # a step made again begins at the attitude nearest to it
            states = np.array([flow.settled(z, k * flow.step) for k, z in enumerate(states)])
        if ends_alike(flow, states[0], scale):
            return Departure(1.0, name=ALIKE, step=float(run.step), asked=run.steps)
        row, gap = in_another_order(flow, states, scale)
    except DiscmechError as failure:
        return Departure(unknown=" ".join(str(failure).split()))
    return Departure(
        gap, MADE_AGAIN * rule.unit(16), "the same step, made again after others,",
        float(run.step), f"{ROW}{row - 1} of {run.steps}", asked=run.steps,
    )  # fmt: skip


def keeps_something(scheme: Any, *start: Vector) -> bool:
    """True if a step of a function changes what it reads, or what that is cannot be told.

    The scene in numbers is read, too: a program may write to it. start: x and μ of the steps, the
    scene's own if there are none. A step that fails tells nothing.
    """
    flow = scheme.flow(scheme.rule.step_for(OTHER_STEP * Fraction(scheme.scene.step)))
    fresh = SceneInNumbers(scheme.s, scheme.scene, arithmetic(16))
    own = {*vars(fresh), *dir(SceneInNumbers)}
    begin: Any = dict(zip(("x0", "mu0"), start, strict=False))

    def read(steps: int) -> str:
        with suppress(StepFailure):
            flow.trajectory(steps, **begin)  # a memory of the last state alone changes with it
        left = {name: value for name, value in vars(flow.system).items() if name not in own}
        values = vars(flow.system.parameters)
        return reads(scheme.rule.formula, *scheme.rule.beside, left, values, pure=True)

    try:
        return read(2) != read(3)
    except Opaque:
        return True


def _of_count(scheme: Any) -> Departure:
    """Return what runs from three states of a motion do at the same number of steps, if they do."""
    whole, unit = run_of(scheme, steps := steps_of(scheme)), scheme.rule.unit(16)
    drawn = np.random.default_rng(steps)
    first = [0, *(int(steps * drawn.uniform(*share)) for share in BEGIN)]
    count, unlike = steps - first[-1], list[set[int]]()
    scale = _sizes(_states(whole))
    for k in first:
        run = whole if not k else scheme.flow(whole.step).trajectory(
            steps - k, x0=whole.x[k], mu0=whole.mu[k], t0=k * whole.step)  # fmt: skip
        rows = (row for _, row in peaks(_states(run) / scale, 1, unit))
        unlike.append({row for row in rows if NEARBY < row <= count})
    near = [{row + k for row in each for k in range(-1, WIDTH - 1)} for each in unlike[1:]]
    common = sorted(unlike[0].intersection(*near))
    by_chance = len(unlike[0]) * math.prod(len(each) / count for each in near)
    if not common or by_chance ** len(common) / math.factorial(len(common)) > RARE:
        return Departure(asked=count)
    said = f"its runs from three states all do something else at their step {common[0]}, of "
    said += f"{float(whole.step):.3g}, than at those beside it: it counts its steps, and few steps "
    return Departure(unknown=f"{said}from drawn states say nothing of so late a one", asked=count)


def _states(run: Any) -> Matrix:
    return np.hstack([run.x, run.mu]).astype(float)


def _sizes(states: Matrix) -> Vector:
    sizes = np.abs(states).max(axis=0)
    return np.where(sizes > 0, sizes, 1)
