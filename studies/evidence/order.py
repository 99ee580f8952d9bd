"""The order of one very small step, from exact states: an order that no final time or run can hide.

A method of order p is off by O(h^{p+1}) after one step. With 50 digits, and ten more for each order
above 8, this shows at steps so small that every lower power of exact numbers would stand out, if
its factor is above round-off there; and in each component by itself.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from discmech.integrators import Scheme, StepFailure
from discmech.integrators.flows import Flow, round_off_from
from discmech.integrators.numbers import Matrix, mpmath
from discmech.reference import surroundings

from .grid import Floor
from .places import Place, random_fraction

if TYPE_CHECKING:
    from discmech.reference.answer.local_motion import ExactState

#: (component, error of a step, bound of round-off), mpf
StepError: TypeAlias = tuple[str, Any, Any]
GUARD = 15
#: the share of the digits, less 14, by which the error of a step is below the motion at the
#: expected order; if no error shows, the next: a constant may be as small as Kahan and Li's
SMALL = (Fraction(1), Fraction(2, 3), Fraction(1, 3))
#: an ordinary step as a part of the time in which the motion is that of a short polynomial
PART = Fraction(1, 8)
#: the second of two steps leaves 10^-FALLEN of the first one's error at the expected order, times a
#: factor drawn from RATIO: over so large a ratio a factor sin²(log h) is no other order
FALLEN, RATIO = 8, (0.7, 1.0)
# share of the longest step, so that errors of order 16 differ by less than `UNLIKE`
FIRST = 0.85, 1.0
NEAR = 0.1  # largest distance of a local order from the expected one
#: distance of an order from a whole number; beyond it, the longer of two steps shows the next power
#: too. A share δ of it there shifts the order by log(1 + δ)/log(ratio). From the middle of the two
#: steps (in powers of the step) to the shorter one, δ is smaller by the root of the ratio.
WHOLE = 1e-3
#: where two powers of the step are still mixed, the lower one stands out at shorter steps: they are
#: shortened by this so many times, 2⁻³⁰ in all, where an error of 10⁻¹⁷ h² still exceeds round-off
SHORTER, FURTHER = 64, 5
UNLIKE = 100  # an error is measured again if it is so many times that at other places
CLEAR = 1000  # above so many round-offs an error is the method's, to a part in a thousand


@dataclass(frozen=True)
class ComponentOrder:
    """The local order of one component at one place, and C of its error C h^{order+1}.

    name: such as x[0] or mu[2]. order: None if only round-off shows. error: that of the longer
    step, mpf.
    """

    name: str
    order: float | None
    constant: float | None
    place: Place
    error: Any = 0


@dataclass(frozen=True)
class LocalOrder:
    """The lowest order that one step shows at the places, with its component and place.

    order: None if only round-off shows: the method is exact there. step: the larger of the two
    steps compared. components: all components, at all places. unknown: one sentence why there is no
    evidence; empty if there is some. refused: True if the reason is that the rule made no small
    step anywhere, where its scene has exact motion. sunk: True of a program whose errors sink into
    round-off before they show a power of the step. floor: that of a program's own numbers, above
    which the order is (`grid`).
    """

    order: float | None
    component: str
    step: float
    place: Place | None = None
    components: tuple[ComponentOrder, ...] = ()
    unknown: str = ""
    refused: bool = False
    sunk: bool = False
    floor: Floor | None = None

    @property
    def exact(self) -> bool:
        """True if every step, at every place, is the exact motion to round-off."""
        return not self.unknown and self.order is None and not self.sunk


def digits_for(order: int) -> int:
    """Return the digits in which an error of that order shows at small steps.

    The error of Gauss's rule of s stages, (s!)⁴ h^{2s+1} / ((2s+1) (2s)!³), is 10⁻²³ h¹⁷ at order
    16, with h in units of the motion: 10⁻⁴⁵ before h is small. With 130 digits it shows at 10⁻⁴ of
    the motion, as that of order 8 does with 50.
    """
    return 50 + 10 * max(0, order - 8)


def local_order(
    scheme: Scheme, places: Sequence[Place], seed: int, along: Sequence[Place] = ()
) -> LocalOrder:
    """Return the lowest order of two steps from each place, where the largest error tells one.

    Of D digits, h^{p+1} ≈ 10^{-(D - 14) SMALL} of the motion; the ratio of the steps is drawn from
    the seed. along: places from which one step is made, and measured again where its error differs
    from those at the places. Raises the errors of runs and references.
    """
    drawn = random.Random(seed)
    expected = scheme.order or 2
    digits = digits_for(expected)
    components: list[ComponentOrder] = []
    pending = list(places)
    shown: Sequence[Flow] = ()
    missed: StepFailure | None = None
    for part in SMALL:
        length = PART * min(place.length for place in places)
        longest = length * Fraction(10.0 ** (-float((digits - 14) * part) / (expected + 1)))
        left = []
        for place in pending:
            # steps differ by place: a small factor at one of two misleads at one place only
            first = longest * random_fraction(drawn, *FIRST)
            shorter = Fraction(10.0 ** (-FALLEN / (expected + 1))) * random_fraction(drawn, *RATIO)
            flows = [scheme.flow(h, digits) for h in (first, first * shorter)]
            try:
                here = at_place(scheme, place, flows, digits)
            # at rest under constraints u is the round-off of x over h
            except StepFailure as failure:
                missed, here = failure, []
            largest = max(here, key=lambda c: c.error, default=None)
            told = largest is not None and (largest.order is not None or part == SMALL[-1])
            if not told:
                left.append(place)
            # a lower power that shows already may be too small a part of an error at longer steps
            if here := [c for c in here if told or c.order is not None]:
                components += here
                shown = shown or flows
        pending = left
        if not pending:
            break
    if not components and missed is not None:
        raise missed
    for place in along:
        if _unlike(scheme, place, shown[0], components, digits):
            components += at_place(scheme, place, shown, digits)
    seen = [c for c in components if c.order is not None]
    if not seen:
        return LocalOrder(None, "", float(shown[0].step), components=tuple(components))
    lowest = min(seen, key=lambda c: c.order or 0.0)
    assert lowest.order is not None
    return LocalOrder(
        lowest.order, lowest.name, float(shown[0].step), lowest.place, tuple(components)
    )


def _unlike(
    scheme: Scheme, place: Place, flow: Flow, components: Sequence[ComponentOrder], digits: int
) -> bool:
    """True if a step from a place has an error far above those found in that component."""
    (end,) = surroundings(scheme.scene).after(
        place.x, place.u, place.t, [flow.step], digits + GUARD
    )
    with mpmath.workdps(digits + GUARD):
        run = flow.trajectory(1, **place.start)
        rows = zip(names_of(end), [*run.x[-1], *run.mu[-1]], [*end.x, *end.mu],
                   [*place.x, *place.mu], strict=True)  # fmt: skip
        for name, got, wanted, start in rows:
            known = max((c.error for c in components if c.name == name), default=0)
            least = (abs(start) + abs(wanted - start)) * mpmath.mpf(10) ** (6 - digits)
            if abs(mpmath.mpf(got) - wanted) > UNLIKE * max(known, least):
                return True
    return False


def step_errors(
    scheme: Scheme, place: Place, flow: Flow, exact: ExactState, count: int = 1,
    slopes: Matrix | None = None,
) -> list[StepError]:  # fmt: skip
    """Return (component, error of `count` steps from a place, bound of round-off), in mpmath.

    slopes: for a program |∂fⱼ/∂zᵢ|, rows j; none for a formula. Steps of a run over a short time
    add nearly the same to nearly the same numbers, and so are rounded alike: by `count` roundings.
    """
    with mpmath.workdps(flow.digits + GUARD):
        run = flow.trajectory(count, every=count, **place.start)
        got, wanted = [*run.x[-1], *run.mu[-1]], [*exact.x, *exact.mu]
        known = [*exact.error_x, *exact.error_mu]
        own = _round_off(flow, place)
        if slopes is not None:
            rates = slopes @ np.array([abs(float(e)) for e in (*place.x, *place.mu)])
            unit, time = 2 * scheme.rule.unit(flow.digits) * count, abs(float(flow.step)) * count
            own = [a + unit * (abs(b) + time * rate)
                   for a, b, rate in zip(own, got, rates, strict=True)]  # fmt: skip
        names = names_of(exact)
        return [
            (name, mpmath.mpf(a) - b, bound + error)
            for name, a, b, error, bound in zip(names, got, wanted, known, own, strict=True)
        ]


def names_of(exact: ExactState) -> list[str]:
    """Return the components of a state, such as x[0] and mu[2]."""
    names = [f"x[{i}]" for i in range(len(exact.x))]
    return names + [f"mu[{i}]" for i in range(len(exact.mu))]


def at_place(
    scheme: Scheme, place: Place, flows: Sequence[Flow], digits: int
) -> list[ComponentOrder]:
    """Return the local order of each component at one place, from the flows of two steps."""
    made = {flow.step: flow for flow in flows}

    def errors(steps: Sequence[Fraction]) -> list[list[StepError]]:
        ends = surroundings(scheme.scene).after(place.x, place.u, place.t, steps, digits + GUARD)
        return [step_errors(scheme, place, made.get(step) or scheme.flow(step, digits), end)
                for step, end in zip(steps, ends, strict=True)]  # fmt: skip

    steps = [flow.step for flow in flows]
    return orders(scheme.order or 2, place, steps, errors, digits)


def orders(
    expected: int,
    place: Any,
    steps: Sequence[Fraction],
    errors: Callable[[Sequence[Fraction]], list[list[StepError]]],
    digits: int,
    halved: bool = False,
) -> list[ComponentOrder]:
    """Return the local order of each component at one place, from the errors of two steps.

    An order that is below the expected one and no whole number is measured again, from a step
    between the two to the shorter one and on to shorter ones (`WHOLE`, `SHORTER`), unless `halved`.
    """
    both = errors(steps)
    components = []
    with mpmath.workdps(digits + GUARD):
        ratio = mpmath.log(mpmath.mpf(steps[0].numerator) / steps[0].denominator
                           * steps[1].denominator / steps[1].numerator)  # fmt: skip
        for (name, large, _), (_, small, left) in zip(*both, strict=True):
            large, small = abs(large), abs(small)
            if not small > CLEAR * left:
                components.append(ComponentOrder(name, None, None, place, large))
                continue
            order = float(mpmath.log(large / small) / ratio) - 1
            size = float(mpmath.log10(large) - (order + 1) * mpmath.log10(steps[0]))
            components.append(
                ComponentOrder(name, order, 10.0**size if abs(size) < 300 else None, place, large)
            )
    if halved or not any(map(partial(_is_mixed, expected), components)):
        return components
    with mpmath.workdps(digits + GUARD):
        between = Fraction(math.exp(-float(ratio) / 2)) * steps[0]
    first = between
    for k in range(1 + FURTHER):
        last = steps[1] / SHORTER**k
        nearer = orders(expected, place, (first, last), errors, digits, halved=True)
        # only orders that are too low here too are replaced: shorter steps find no order that was
        # not there
        components = [replace(b, error=a.error)
                      if _is_mixed(expected, a) and _is_low(expected, b) else a
                      for a, b in zip(components, nearer, strict=True)]  # fmt: skip
        if not any(map(partial(_is_mixed, expected), components)):
            break
        first = last
    return components


def _is_low(expected: int, component: ComponentOrder) -> bool:
    return component.order is not None and component.order < expected - NEAR


def _is_mixed(expected: int, component: ComponentOrder) -> bool:
    """True if a low order comes from two mixed powers of the step, and not from one alone."""
    order = component.order or 0.0
    return _is_low(expected, component) and abs(order - round(order)) > WHOLE


def _round_off(flow: Flow, place: Place) -> list[Any]:
    """Return the round-off bound of each component in a step from a place (`step_round_off`)."""
    s = flow.scheme.s
    if not flow.scheme.rule.is_formula:  # a program rounds one operation, beside its start
        unit = flow.scheme.rule.unit(flow.digits)
        sizes = [[abs(e) for e in part] for part in (place.x, place.mu)]
        if flow.scheme.rule.own_coordinates:  # a rounding there changes all entries alike
            sizes = [[max(part)] * len(part) if part else part for part in sizes]
        return [2 * unit * e for part in sizes for e in part]
    with flow.numbers.working():
        x, mu = flow.context.vectors(s.with_time(place.x, place.t), place.mu)
        near = flow.context.vector(place.u, len(mu))
        *_, bound = round_off_from(flow.context, x, mu, near)
        bounds = list(flow.numbers.public(bound * flow.numbers.eps))
    return bounds[: len(place.x)] + bounds[len(x) :]  # without the time, where it is a component


def unknown(why: str, refused: bool = False) -> LocalOrder:
    """Return an order without evidence, for that reason."""
    return LocalOrder(None, "", 0.0, unknown=why, refused=refused)
