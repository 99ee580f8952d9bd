"""The order of one very small step, from exact states: what no final time and no run can hide.

A method of order p is off by O(h^{p+1}) after one step. With 50 digits, and ten more for each order
above 8, that is seen at steps so small that every lower power would stand out, however small its
factor; and in each component by itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from discmech import reference
from discmech.integrators import Scheme
from discmech.integrators.flows import Flow, round_off_from
from discmech.integrators.numbers import mpmath

GUARD = 15
#: the part of the digits, less 14, by which the error of a step is below the motion at the expected
#: order; where nothing is seen of it, the next: a constant may be as small as Kahan and Li's
SMALL = (Fraction(1), Fraction(2, 3), Fraction(1, 3))
#: where steps are made, in steps of the scene from the start, where a motion may be at rest
PLACES = (Fraction(7), Fraction(61, 5))
USUAL = (1, 2, 4)  # orders of most rules
NEAR = 0.1  # of a local order that is the expected one
CLEAR = 1000  # round-offs above which an error is the method's, to a part in a thousand


@dataclass(frozen=True)
class LocalOrder:
    """The lowest order that one step shows, and the component of x or μ that shows it.

    None where nothing but round-off is seen. step: the larger of the two steps compared.
    """

    order: float | None
    component: str
    step: float


@lru_cache(maxsize=256)
def local_order(scheme: Scheme) -> LocalOrder:
    """From steps h and h/2 at `PLACES`, h^{p+1} ≈ 10^{-(D - 14) SMALL} scene steps of D digits.

    Raises what runs raise. Where time enters, the only place is the start.
    """
    digits = digits_for(scheme.order or 2)
    for part in SMALL:
        found = _at(scheme, int((digits - 14) * part), digits)
        if found.order is not None:
            break
    return found


def digits_for(order: int) -> int:
    """Digits in which an error of that order is seen at steps that are small.

    The error of Gauss's rule of s stages, (s!)⁴ h^{2s+1} / ((2s+1) (2s)!³), is 10⁻²³ h¹⁷ at order
    16, with h in units of the motion, a scene step being a twentieth: 10⁻⁴⁵ before h is small. With
    130 digits it is seen at 10⁻⁴ scene steps, as that of order 8 with 50.
    """
    return 50 + 10 * max(0, order - 8)


def _at(scheme: Scheme, small: int, digits: int) -> LocalOrder:
    scene, expected = scheme.scene, scheme.order or 2
    steps = _steps(scene, expected, small)
    places = (Fraction(0),) if scheme.s.clocked else PLACES
    begins = [place * Fraction(scene.step) for place in places]
    # for usual orders too: the way there is long, and gone once for all rules of the scene
    ends = (h for order in {expected, *USUAL} for h in _steps(scene, order, small))
    times = {t + h for h in (Fraction(0), *ends) for t in begins}
    states = reference.solutions(scene, sorted(times), digits + GUARD)
    exact = dict(zip(sorted(times), states, strict=True))
    found: list[tuple[float, str]] = []
    with mpmath.workdps(digits + GUARD):
        for t in begins:
            errors = []
            for h in steps:
                start, end = exact[t], exact[t + h]
                flow = scheme.flow(h, digits)
                run = flow.trajectory(1, x0=start.x, mu0=start.mu, u0=start.v)
                got, wanted = [*run.x[-1], *run.mu[-1]], [*end.x, *end.mu]
                errors.append([abs(a - b) for a, b in zip(got, wanted, strict=True)])
            own = _round_off(flow, start)
            names = [f"x[{i}]" for i in range(len(end.x))]
            names += [f"mu[{i}]" for i in range(len(end.mu))]
            for name, large, small, left in zip(names, *errors, own, strict=True):
                if small > CLEAR * left:
                    found.append((float(mpmath.log(large / small, 2)) - 1, name))
    order, component = min(found, default=(None, ""))
    return LocalOrder(order, component, float(steps[0]))


def _steps(scene: Any, order: int, small: int) -> list[Fraction]:
    """A step h with h^{p+1} ≈ 10^{-small} scene steps, and half of it."""
    size = Fraction(1, 2 ** math.ceil(small / (order + 1) * math.log2(10)))
    return [Fraction(scene.step) * size / k for k in (1, 2)]


def _round_off(flow: Flow, start: Any) -> list[Any]:
    """What round-off may do to each component in a step from there (`step_round_off`)."""
    with flow.numbers.working():
        x, mu = flow.context.vectors(start.x, start.mu)
        near = flow.context.vector(start.v, len(mu))
        *_, bound = round_off_from(flow.context, x, mu, near)
        found = list(flow.numbers.public(bound * flow.numbers.eps))
    return found[: len(start.x)] + found[len(x) :]  # without the time, where it is a component
