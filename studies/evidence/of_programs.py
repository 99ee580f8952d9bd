"""The order of single steps of a program, which has the digits of machine numbers alone.

Its steps are not small, so that several powers of the step count at once. The error of a smooth
step is a sum of them from h^{p+1} on, and a lower power is denied where such a sum explains all
errors of a ladder to their round-off, beyond which a lower one would stand out at some of the
steps. A program that jumps, as by a loose iteration, has no such sum.
"""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from discmech import reference
from discmech.integrators import BadInput, Scheme, StepFailure
from discmech.integrators.errors import Displaced
from discmech.integrators.numbers import Matrix, Vector
from discmech.reference import surroundings

from ..core.fitting import orders_between
from .grid import Floor, Grid, grids_of, units_of
from .isolated import isolated
from .order import (
    GUARD,
    NEAR,
    ComponentOrder,
    LocalOrder,
    digits_for,
    local_order,
    step_errors,
    unknown,
)
from .places import Place, random_fraction
from .powers import Ladder, Powers, lower_together, powers_of

#: steps of a program from a place: the first as a share of the time in which the motion is that of
#: a short polynomial, the ratio of the next to it, and their number
FIRST_OF_PROGRAM, PART_OF_PROGRAM, COUNT_OF_PROGRAM = Fraction(1, 2), 0.6, 28
#: slopes of the error have settled where two successive ones differ by less than SETTLED; the next
#: term of the error, which sinks as they do, is then subtracted
COUNT_REMEMBERING = 14
SETTLED = 0.12
GROWN = 30  # the order is not p if an error over h^{p+1} grows so many times as steps sink
CLEAR_OF_PROGRAM = 100  # an error of so many round-offs gives a slope to a part in ten
#: so many times one rounding of the start and one of the end, on the grid of a program's own
#: numbers, are its rounding: a step may have a few operations on the grid
ON_GRID = 4


def of_program(scheme: Scheme, places: Sequence[Place], seed: int) -> LocalOrder:
    """Return the local order of a program in machine numbers, from its errors at ever smaller
    steps.

    Steps of a few digits are not small, so the slope between two of them is no order yet: it is one
    where slopes settle (`SETTLED`) before round-off. Other components are left out. Where none
    settles, errors have to sink into round-off all the same: those of a high order do so at once.
    Numbers on a grid of the program's own have a floor that is no error of its method, if this
    grid and the expected order explain all errors.
    """
    components: list[ComponentOrder] = []
    drawn, expected = random.Random(seed), scheme.order or 1
    shown, sunk = 0.0, True
    # a rule with memory starts in its own way, and has its order over a time, not in a step
    repeats = scheme.rule.repeats
    power = 1 if repeats else 0  # the power of the step that an error has beyond the order
    wanted = expected + power
    looks = [_look(scheme, place, drawn, not repeats) for place in places]
    outputs = [output for look in looks for output in look.outputs]
    own = outputs if scheme.rule.unit(16) <= 2.0**-53 else []  # fewer digits may be declared
    grids = grids_of(own) if own else []
    of_grids: list[Floor] = []
    hidden: list[tuple[str, Powers]] = []
    ladders = list[Ladder]()
    for look in looks:
        floors = look.floors(grids) if any(grids) else np.zeros((len(look.steps), len(look.names)))
        for k, name in enumerate(look.names):
            signed, left, rounding = look.errors[:, k], look.left[:, k], floors[:, k]
            errors = np.abs(signed)
            order, constant, step = _slope(look.steps, errors, left, wanted)
            clear = [errors > CLEAR_OF_PROGRAM * off for off in (left, left + rounding)]
            if (clear[0] != clear[1]).any():
                over = _slope(look.steps, errors, left + rounding, wanted)
                sinking = over[0] if over[0] and over[1] else wanted
                near = left + ON_GRID / CLEAR_OF_PROGRAM * rounding
                if _explained(look.steps, errors, near, sinking):
                    of_grids.append(look.floor(grids))
                    left, (order, constant, step) = left + rounding, over
            ladders.append((look.steps, signed, left))
            powers = powers_of(*ladders[-1], wanted)
            if powers.hidden is not None:
                hidden.append((name, powers))
            elif powers.first and _other(order, powers.first, wanted):
                order, constant = float(powers.first), abs(powers.factor)
            shown = shown or step
            order = None if order is None else order - power
            components.append(ComponentOrder(name, order, constant, look.place))
            sunk = sunk and bool(errors[-1] <= CLEAR_OF_PROGRAM * left[-1])
    low = any((c.order or expected) < expected - NEAR for c in components)
    if not (low or hidden) and (together := lower_together(ladders, wanted)):
        at, powers = together
        components[at] = replace(components[at], order=float((powers.first or 0) - power),
                                 constant=abs(powers.factor))  # fmt: skip
    floor = max(of_grids, key=lambda each: each.share, default=None)
    seen = [c for c in components if c.order is not None]
    if hidden and not any((c.order or expected) < expected - NEAR for c in seen):
        name, powers = max(hidden, key=lambda pair: pair[1].hidden or 0.0)
        why = f"the error of a step in {name} is no sum of powers of the step from "
        why += f"h^{wanted} on, to round-off: it may hide {powers.hidden:.1g} h^{wanted - 1}"
        why += "; to settle it, compute all in double precision, and iterate until nothing changes"
        return replace(unknown(why), floor=floor)
    if not seen and sunk and floor is None:
        return LocalOrder(None, "", 0.0, components=tuple(components), sunk=True)
    if not seen:
        why = "the error of a step settles to no power of it above round-off"
        return replace(unknown(why), floor=floor)
    lowest = min(seen, key=lambda c: c.order or 0.0)
    return LocalOrder(
        lowest.order, lowest.name, shown, lowest.place, tuple(components), floor=floor
    )  # fmt: skip


def _other(slope: float | None, first: int, wanted: int) -> bool:
    """True if a sum from that power on explains all errors, and their last slope is another.

    From the wanted power on it explains errors of higher powers too.
    """
    if slope is None:
        return first < wanted
    return slope < first - NEAR or (first < wanted and slope > first + NEAR)


@dataclass(frozen=True, eq=False)
class _Look:
    """Steps of a program from a place: errors and bounds of round-off (r, k), by component.

    times: those of the ends. outputs: the program's own numbers there.
    """

    place: Place
    flows: Sequence[Any]
    times: Vector
    names: Sequence[str]
    errors: Matrix
    left: Matrix
    slopes: Matrix

    @property
    def steps(self) -> list[float]:
        return [float(flow.step) for flow in self.flows]

    @property
    def outputs(self) -> list[Vector]:
        return [flow.answer for flow in self.flows if hasattr(flow, "answer")]

    def floors(self, grids: Sequence[Grid | None]) -> Matrix:
        """Return the largest effect of one rounding of the start and one of the end, (r, k)."""
        moved = [flow.moved_by(units_of(grids, flow.answer)) for flow in self.flows]
        return np.array([2 * e + abs(t) * self.slopes @ e
                         for e, t in zip(moved, self.times, strict=True)])  # fmt: skip

    def floor(self, grids: Sequence[Grid | None]) -> Floor:
        """Return the floor in words, by the coarsest grid."""
        flow = self.flows[0]
        units = units_of(grids, flow.answer)
        coarsest = grids[int(units.argmax())]
        assert coarsest is not None
        size = np.linalg.norm([float(e) for e in (*self.place.x, *self.place.mu)])
        share = float(flow.moved_by(units).max() / size) if size else 0.0
        return Floor(float(units.max()), share, coarsest.words)


def _look(scheme: Scheme, place: Place, drawn: random.Random, remembers: bool) -> _Look:
    """Return the steps of a program from a place, ever smaller."""
    steps = [place.length * FIRST_OF_PROGRAM * random_fraction(drawn, 0.7, 1)]
    counts = [1] * COUNT_OF_PROGRAM
    if remembers:  # numbers of one parity, of which errors of a method of two steps know
        counts = [4 * math.ceil(1.45**k) for k in range(COUNT_REMEMBERING)]
        steps = [steps[0] / count for count in counts]
    while len(steps) < COUNT_OF_PROGRAM and not remembers:
        steps.append(steps[-1] * random_fraction(drawn, PART_OF_PROGRAM - 0.1,
                                                 PART_OF_PROGRAM + 0.1))  # fmt: skip
    times = [count * h for count, h in zip(counts, steps, strict=True)]
    ends = surroundings(scheme.scene).after(place.x, place.u, place.t, times, 16 + GUARD)
    flows = [scheme.flow(h, 16) for h in steps]
    slopes = _slopes(flows[0], place)
    rows = [step_errors(scheme, place, flow, end, count, slopes)
            for flow, end, count in zip(flows, ends, counts, strict=True)]  # fmt: skip
    errors, left = (np.array([[float(each[i]) for each in row] for row in rows]) for i in (1, 2))
    names = [name for name, _, _ in rows[0]]
    return _Look(place, flows, np.array([float(t) for t in times]), names, errors, left, slopes)


def _explained(steps: Sequence[float], errors: Vector, left: Vector, power: float) -> bool:
    """True if errors sink as a power of the step, but for bounds of round-off."""
    sizes = np.array(steps) ** power
    usual = GROWN * (errors[:3] / sizes[:3]).max() * sizes
    return bool((errors <= usual + CLEAR_OF_PROGRAM * left).all())


def _slope(
    steps: Sequence[float], errors: Vector, left: Vector, power: int
) -> tuple[float | None, float | None, float]:
    """Return (the power of the step in errors above round-off, its factor, the last such step)."""
    clear = [(h, float(e)) for h, e, off in zip(steps, errors, left, strict=True)
             if e > CLEAR_OF_PROGRAM * off]  # fmt: skip
    slopes = orders_between(*zip(*clear, strict=True)) if clear else []
    rests = [e / h**power for h, e in clear]
    gaps = [abs(a - b) for a, b in itertools.pairwise(slopes[-3:])]
    if len(gaps) == 2 and max(gaps) < SETTLED:
        ratio = clear[-1][0] / clear[-2][0]
        order = slopes[-1] + (slopes[-1] - slopes[-2]) * ratio / (1 - ratio)
        return order, clear[-1][1] / clear[-1][0] ** order, clear[-1][0]
    if len(rests) > 6 and min(rests[-3:]) > GROWN * max(rests[:3]):
        # it is not of the expected order, for whatever cause: single precision inside, or noise
        whole = clear[len(clear) // 2 :]
        order = orders_between(*zip(whole[0], whole[-1], strict=True))[0]
        return order, None, clear[-1][0]
    return None, None, 0.0


def _slopes(flow: Any, place: Place) -> Matrix:
    """Return |∂fⱼ/∂zᵢ|, rows j: how fast an error of a state grows; 0 where that is unknown.

    With |z| it tells how a program's round-off of a state grows. A component that is 0 has no
    round-off of its own, but its next value is rounded, and so is the state from which its rate is
    computed.
    """
    z = np.array([float(e) for e in (*place.x, *place.mu)])
    if flow.scheme.scene.all_constraints:
        return np.zeros((len(z), len(z)))
    system = flow.system
    n, t = len(place.x), float(place.t)
    columns = []
    for i in range(len(z)):
        size = 2.0**-20 * (abs(z[i]) or np.abs(z).max() or 1.0)
        way = size * (np.arange(len(z)) == i)
        ends = [np.concatenate(system.f(at[:n], at[n:], t)) for at in (z - way, z + way)]
        columns.append(abs(ends[1] - ends[0]).astype(float) / (2 * size))
    return np.nan_to_num(np.array(columns).T, posinf=0.0)


def order_of(
    scheme: Scheme, places: Sequence[Place], seed: int, along: Sequence[Place]
) -> LocalOrder:
    """Return `local_order` or `of_program`, or the reason why there is none.

    A program that runs in numbers of any kind is run in doubles too, where it may be another one.
    Raises `Displaced` for a program whose answers begin elsewhere.
    """
    try:
        if scheme.digits(wanted := digits_for(scheme.order or 2)) < wanted:
            return _lower_in_runs(scheme, of_program(scheme, places, seed))
        local = local_order(scheme, places, seed, along)
        if scheme.rule.is_formula:
            return local
        return _lower_in_runs(scheme, _lower_in_doubles(scheme, places, seed, local))
    except Displaced:
        raise
    except (BadInput, StepFailure, reference.ReferenceFailure) as failure:
        refused = not isinstance(failure, reference.ReferenceFailure)
        return unknown(" ".join(str(failure).split()), refused)


def _lower_in_runs(scheme: Scheme, local: LocalOrder) -> LocalOrder:
    """Return the order of single steps from places, or that of `isolated` steps, if it is lower."""
    if local.order is None or (lowest := isolated(scheme)) is None:
        return local
    if (lowest.order or 0.0) >= local.order - NEAR:
        return local
    return replace(local, order=lowest.order, component=lowest.name, place=lowest.place,
                   components=(*local.components, lowest))  # fmt: skip


def _lower_in_doubles(
    scheme: Scheme, places: Sequence[Place], seed: int, local: LocalOrder
) -> LocalOrder:
    """Return the order in more digits, or that in doubles where a component's is below both.

    Doubles that no order explains leave it unknown, as those of a program in doubles alone.
    """
    least = min(scheme.order or 1, scheme.order or 1 if local.order is None else local.order)
    in_doubles = of_program(scheme, places, seed)
    if in_doubles.unknown:
        return in_doubles
    low = [
        c
        for c in in_doubles.components
        if c.constant is not None and (c.order or 0.0) < least - NEAR
    ]
    lowest = min(low, key=lambda c: c.order or 0.0, default=None)
    if lowest is None:
        return local
    return replace(local, order=lowest.order, component=f"{lowest.name} in double precision",
                   step=float(lowest.place.length), place=lowest.place,
                   components=(*local.components, lowest))  # fmt: skip
