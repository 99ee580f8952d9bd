"""The derivatives that a program gives itself, held against differences of its own steps.

Each entry of a difference has a bound of its truncation and round-off (`foreign.differences`). What
is off beyond it is certain, and the bound says what could be hidden.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np

from discmech.integrators import BadInput, StepFailure
from discmech.integrators.errors import RAISED, shown, unknown
from discmech.integrators.extensions.foreign import (
    Derivative,
    Noise,
    derivative,
    guarded,
    noise_of,
    shifted,
)
from discmech.integrators.numbers import Matrix, Vector

from .places import Look
from .records import Held

#: a `BoxFlow` or a `BlackBox`
Flow: TypeAlias = Any
Rule: TypeAlias = Any

START = "start"  # the name of the state at which a run begins, beside those of parameters
STEPS = 16  # steps of the runs whose gradient is asked at every place
#: Longer runs, from two places: a drawn part of the scene's steps, halved while differences hide
#: more than `TOLD` of the motion.
MOST_STEPS, PARTS, PLACES = 2**11, (0.6, 1.0), 2
TOLD = 0.01  # of the motion: what differences of a run hide, or one of half as many steps is made
PART = 1 / 8  # share of a parameter's size over which it is varied: its sign stays
HALF = 2.0**-26  # half of the digits of a double
ROUNDINGS = 64  # of one step's derivative, in units of its largest entry


def of_step(
    flow: Flow, f: Any, look: Look, scale: Vector, noise: Noise
) -> tuple[Derivative, list[Held]]:
    """Return the program's own derivative of a step, or one by differences, and their distance."""
    rule, size = flow.scheme.rule, len(look.z)
    seen = derivative(shifted(f, look.z), size, scale, noise)
    if rule.jacobian is None or look.count > 1:
        return seen, []
    matrix = asked_jacobian(flow, look.z, look.time)
    rounding = ROUNDINGS * rule.unit(16)
    off, hidden = distance(matrix, seen, scale, scale, rounding)
    own = Derivative(matrix, rounding * np.abs(matrix))
    return own, [Held("jacobian", START, off, hidden)]


def of_run(flow: Flow, look: Look, scale: Vector, seed: int, place: int) -> list[Held]:
    """Return the distances of the program's gradient of runs, by the start and by parameters.

    From the first places runs are as long as the scene's, too. Where differences tell nothing of
    one, it is halved.
    """
    if flow.scheme.rule.gradient is None or look.count == 1:
        return []
    held = _of_steps(flow, look, scale, seed + place, STEPS)
    most = min(MOST_STEPS, flow.scheme.scene.steps_for(flow.scheme.scene.step))
    steps = int(most * np.random.default_rng(seed).uniform(*PARTS)) * (place < 2 * PLACES)
    while steps > STEPS and not any(each.off for each in held):
        longer = _of_steps(flow, look, scale, seed + place, steps)
        held += longer
        if longer and all(each.hidden <= TOLD for each in longer):
            break
        steps //= 2
    return held


def _of_steps(flow: Flow, look: Look, scale: Vector, seed: int, steps: int) -> list[Held]:
    try:
        growth = _growth(flow, look, scale, steps) if steps > STEPS else 1.0
    except StepFailure:
        return []
    gradient = _asked(flow, "gradient", look.z, look.time, steps)
    by_name = gradient if isinstance(gradient, dict) else {START: gradient}
    return [_by(flow, look, scale, seed, steps, growth, *e) for e in by_name.items()]


def _growth(flow: Flow, look: Look, scale: Vector, steps: int) -> float:
    """Return the largest growth of a small change of the start along a run, at least 1.

    The change keeps half of the digits of the program's numbers.
    A rounding of a row's derivative is as large as that has grown, and grows by at most as much
    again, in units of the derivative of the whole run (D_kn = D_0n D_0k⁻¹, which keeps the form).
    """
    n, drawn, rows = flow.system.n, np.random.default_rng(steps), list[Matrix]()
    near = flow.scheme.rule.unit(16) ** 0.5
    for way in (0.0, *drawn.choice((-near, near), (2, len(scale)))):
        z = look.z + way * scale
        run = flow.trajectory(steps, x0=z[:n], mu0=z[n:], t0=look.time)
        rows.append(np.hstack([run.x, run.mu]).astype(float))
    return max(1.0, *(float(np.abs((e - rows[0]) / scale).max()) / near for e in rows[1:]))


def _by(
    flow: Flow, look: Look, scale: Vector, seed: int, steps: int, growth: float, by: str,
    gradient: object,
) -> Held:  # fmt: skip
    rule, n, size = flow.scheme.rule, flow.system.n, len(look.z)
    run, ways, shape = _arguments(flow, look, scale, by, steps)

    def scalar(y: Vector) -> Vector:
        end = run(y)
        return np.array([rule.scalar(end[:n], end[n:])], dtype=float)

    of_state = rule.scalar is None
    f, count = guarded(run if of_state else scalar, size if of_state else 1), len(ways)
    noise = noise_of(f, 0 * ways, ways, rule.unit(16), seed)
    seen = derivative(f, size if of_state else 1, ways, noise)
    array = _array(rule, "gradient", gradient, (size, *shape) if of_state else shape)
    sizes = scale if of_state else np.array([_size_of(rule, run(0 * ways), n, scale)])
    rounding = steps * ROUNDINGS * rule.unit(16) * growth**2
    off, hidden = distance(array.reshape(-1, count), seen, ways, sizes, rounding)
    return Held("gradient", by, off, hidden, steps)


def _size_of(rule: Rule, end: Vector, n: int, scale: Vector) -> float:
    """Return the unit of a program's scalar: its largest change over the size of the motion.

    One that keeps half of its digits everywhere there does not change, and its value is the unit.
    """
    around = [end + sign * way for sign in (-1, 1) for way in np.diag(scale)]
    there, *values = (float(rule.scalar(z[:n], z[n:])) for z in (end, *around))
    change = max(abs(v - there) for v in values)
    return change if change > HALF * abs(there) else abs(there) or 1.0


def _arguments(
    flow: Flow, look: Look, scale: Vector, by: str, steps: int
) -> tuple[Callable[[Vector], Vector], Vector, tuple[int, ...]]:
    """Return (change of the argument ↦ end of the run, the size of each change, its shape)."""
    scheme, t0 = flow.scheme, look.time
    if by == START:
        run = flow.map_of(steps, t0=t0)
        return (lambda y: run(look.z + y)), scale, scale.shape
    known = vars(flow.system.parameters)
    if by not in known:
        raise unknown("parameter", by, [START, *known])
    value = np.array(known[by], dtype=float)
    size = np.abs(value).max(initial=0.0) or 1.0

    def changed(y: Vector) -> Vector:
        moved = scheme.at(parameters={by: (value + y.reshape(value.shape)).tolist()})
        end: Vector = moved.flow(flow.step).map_of(steps, t0=t0)(look.z)
        return end

    ways = PART * np.where(value == 0, size, np.abs(value)).reshape(-1)
    return changed, ways, value.shape


def distance(
    matrix: Matrix, seen: Derivative, ways: Vector, sizes: Vector, rounding: float
) -> tuple[float, float]:
    """Return how far a derivative (k, l) is certainly off, and what differences may hide.

    Both are in units of the motion: arguments vary over ways (l,), values over sizes (k,).
    rounding: that of the given derivative, relative to its largest entry.
    """
    unit = ways / sizes[:, None]
    with np.errstate(all="ignore"):
        unsure = seen.error * unit + rounding * np.abs(matrix * unit).max(initial=0.0)
        off = np.nan_to_num(np.abs(matrix - seen.value) * unit - unsure, nan=-np.inf)
    off = np.where(np.isfinite(matrix), off, np.inf)
    return float(off.max(initial=0.0).clip(0)), float(unsure.max(initial=0.0))


def asked_jacobian(flow: Flow, z: Vector, time: Fraction | int = 0) -> Matrix:
    """Return the program's own derivative of a step; raises `BadInput` if it is none."""
    answer = _asked(flow, "jacobian", z, time)
    return _array(flow.scheme.rule, "jacobian", answer, (len(z), len(z)))


def _asked(flow: Flow, word: str, z: Vector, time: Fraction | int, *steps: int) -> Any:
    """Return what a function of the program answers at a place; raises `BadInput` if it raises."""
    rule, n = flow.scheme.rule, flow.system.n
    flow.system.t = float(time)
    try:
        return getattr(rule, word)(z[:n], z[n:], flow.h, *steps, flow.system)
    except RAISED as error:
        raise BadInput(
            f"the black box {rule.name}: its {word} raises {type(error).__name__}: {error}; it is "
            f"a function of (q, p, h, {'steps, ' * len(steps)}system), also of a map."
        ) from error


def _array(rule: Rule, word: str, answer: object, shape: tuple[int, ...]) -> Matrix:
    try:
        array = np.asarray(answer, dtype=float)
    except (TypeError, ValueError):
        raise BadInput(f"the black box {rule.name}: its {word} gives {shown(answer)}.") from None
    if array.shape != shape:
        raise BadInput(
            f"the black box {rule.name}: its {word} has the shape {array.shape}, but the "
            f"derivative of a {'step' if word == 'jacobian' else 'run'} has {shape}."
        )
    return array
