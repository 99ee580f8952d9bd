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

from .limits import LIMITS
from .places import Look
from .records import Held

#: a `BoxFlow` or a `BlackBox`
Flow: TypeAlias = Any
Rule: TypeAlias = Any

START = "start"  # the name of the state at which a run begins, beside those of parameters
STEPS = 16  # steps of the runs whose gradient is asked at every place
#: Longer runs, from two places: a drawn part of the scene's steps, halved while differences hide
#: more than of the short ones (`may_be_hidden`).
MOST_STEPS, PARTS, PLACES = 2**11, (0.6, 1.0), 2
ROWS = 8  # of a run, at which a rounding of its derivative is followed to its end
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


def may_be_hidden(rule: Rule) -> float:
    """Return the error of a derivative, in units of the motion, that differences may hide."""
    return float(min(0.01, LIMITS["own derivative"] * rule.unit(16) / 2.0**-53))


def of_run(flow: Flow, look: Look, scale: Vector, seed: int, place: int) -> list[Held]:
    """Return the distances of the program's gradient of runs, by the start and by parameters.

    From the first places runs are as long as the scene's, too. Where differences hide too much of
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
        if longer and all(each.hidden <= may_be_hidden(flow.scheme.rule) for each in longer):
            break
        steps //= 2
    return held


def _of_steps(flow: Flow, look: Look, scale: Vector, seed: int, steps: int) -> list[Held]:
    try:
        grown = _roundings_grown(flow, look, scale, steps) if steps > STEPS else 1.0
    except StepFailure:
        return []
    gradient = _asked(flow, "gradient", look.z, look.time, steps)
    by_name = gradient if isinstance(gradient, dict) else {START: gradient}
    return [_by(flow, look, scale, seed, steps, grown, *e) for e in by_name.items()]


def _roundings_grown(flow: Flow, look: Look, scale: Vector, steps: int) -> float:
    """Return how large roundings of a run's derivative become, over the derivative, at least 1.

    A rounding of D_0k, at row k, is as large as that, and at the end D_kn times as large, D_0n the
    derivative of the whole run. Both are told by changes of half of the numbers' digits.
    """
    n, near, drawn = flow.system.n, flow.scheme.rule.unit(16) ** 0.5, np.random.default_rng(steps)

    def states(z: Vector, first: int) -> Matrix:
        time = look.time + first * flow.step
        run = flow.trajectory(steps - first, x0=z[:n], mu0=z[n:], t0=time)
        return np.hstack([run.x, run.mu]).astype(float)

    def grown(z: Vector, first: int, rows: Any) -> Any:
        own = states(z, first)
        ways = drawn.choice((-near, near), (2, len(scale))) * scale
        changes = [np.abs((states(z + way, first) - own) / scale).max(axis=1) for way in ways]
        return np.max(changes, axis=0)[rows] / near

    rows = np.linspace(0, steps, ROWS, endpoint=False).astype(int)[1:]
    at, (*to_row, whole) = states(look.z, 0), grown(look.z, 0, [*rows, steps])
    of_rows = (a * grown(at[k], k, -1) for a, k in zip(to_row, rows, strict=True))
    return float(max(1.0, *(e / whole if whole else np.inf for e in of_rows)))


def _by(
    flow: Flow, look: Look, scale: Vector, seed: int, steps: int, grown: float, by: str,
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
    rounding = steps * ROUNDINGS * rule.unit(16) * grown
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
