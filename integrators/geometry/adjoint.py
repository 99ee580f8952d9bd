"""Self-adjointness of a scheme, derived from its Legendre maps.

The adjoint of Φ has the discrete Lagrangian L_d*(g; h) = −L_d(g⁻¹; −h), whose Legendre maps are
F⁻*(g; h) = −F⁺(g⁻¹; −h) and F⁺*(g; h) = −F⁻(g⁻¹; −h) in the charts of the steps h and −h: both
divided by their step, they are equal.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from ..equations import StepEquations
from ..numbers import arithmetic, random_point, sympy
from ..rules import Discretisation
from .defects import in_round_offs
from .step_map import StagesNotFound, StepMap

#: many digits, because in unfavourable units the terms that distinguish a map from its adjoint may
#: be tiny beside others, for example those of the potential at a random state
DIGITS = 300
#: units of length: in one that is 10³⁵ times longer or shorter than the motion's, what is not
#: symmetric is above 10⁻²⁹⁰ of the rest as the eighth power of a short length, and exp(−x²) of a
#: long one is seen in the next unit
UNITS = (-140, -70, 70, 140)  # powers of 10
#: steps, each a 16th of the one before, of which one has to be found
TRIES = 10


@lru_cache(maxsize=512)
def is_self_adjoint(equations: Any) -> bool:
    """Return True if the Legendre maps of L_d* and L_d agree: then Φ₋ₕ is the inverse of Φₕ.

    This is decided at two random points (`identities`), in x, u, h and the parameters, component by
    component: a difference counts if it exceeds 10¹⁰⁻³⁰⁰ of its own terms, which is above 10²²
    round-offs of the 312 digits. On pairs it is decided in other units of length too, where the
    maps have a value. Internal stages are solved for. A one-step map, and a rule with
    stages of a Lagrangian that is linear in the velocity, are stepped to and fro instead.
    """
    if equations.free is not None:
        return equations.symmetric and is_self_adjoint(equations.free)
    # stages of a Lagrangian that is linear in u are found together with u alone
    by_map = equations.arrows is None or (equations.s.degenerate and len(equations.s.stages))
    gap, most = _gap_of_map if by_map else _gap, 10.0 ** (10 - DIGITS)
    if not all(_at_some_step(gap, equations, seed) < most for seed in range(2)):
        return False
    units = () if by_map or not equations.groupoid.canonical else UNITS
    return not any(_gap_in_unit(equations, unit) >= most for unit in units)


def order_of_step(
    rule: Discretisation, equations: Any, self_adjoint: Callable[[], bool]
) -> int | None:
    """Return the order in (x, μ) of a rule of one step with its equations; None if it states none.

    A self-adjoint method has even order (Hairer, Lubich, Wanner, II.3): so the rectangle rule gains
    one order wherever it turns out self-adjoint, as on a group, where every rule is h·l(u).
    """
    order, groupoid = rule.order, equations.groupoid
    every_chart = groupoid.symmetric_chart or equations.discrete.of.G.gave_velocities
    if order is not None and order > 1 and not every_chart:
        return 1  # u is not the velocity at the middle of the step
    if order is None or order % 2 == 0:
        return None if order is None else int(order)
    return int(order) + (groupoid._inversion is not None and self_adjoint())


def _at_some_step(gap: Callable[..., float], equations: StepEquations, seed: int) -> float:
    """Return a gap at the longest step, of ever shorter ones, that Newton finds."""
    for k in range(TRIES):
        try:
            return gap(equations, seed, 16**k)
        except StagesNotFound:  # of a map, its step
            continue
    return gap(equations, seed, 16**TRIES)


def _gap_in_unit(equations: StepEquations, unit: int) -> float:
    """Return `_gap` at lengths of about 10^unit; nan where the maps have no value there."""
    try:
        return _gap(equations, 0, 1, unit)
    except (ArithmeticError, ValueError):  # no stages, or the root of what is negative
        return float("nan")


def _gap_of_map(equations: StepEquations, seed: int, shorter: int) -> float:
    """Return how far Φ₋ₕ(Φₕ(z)) is from z at a random z.

    It is the largest component of the gap divided by the effect of round-off on it, times ε. So a
    step that moves nothing is its own adjoint.
    """
    s, numbers = equations.s, arithmetic(DIGITS)
    point = random_point([*equations.z, s.h, *s.parameter_list], [s.h], seed)
    with numbers.working():
        x, mu = (np.array([numbers.number(point[e]) for e in part], numbers.dtype)
                 for part in (s.x, s.mu))  # fmt: skip
        after, errors = (x, mu), 0 * abs(np.concatenate([x, mu]))
        for sign in (1, -1):
            parameters = [point[e] for e in s.parameter_list]
            q = s.q_values(sign * point[s.h] / shorter, parameters, numbers)
            geometry = StepMap(equations, numbers, q)
            start = geometry.start(*after, near=0 * mu)
            errors = geometry.step_round_off(*after, start, errors)
            *after, _ = geometry.step(*after, start)  # type: ignore[assignment]
        kept = len(equations.state)  # of a degenerate Lagrangian μ is ϑ(x), wherever it began
        gap = (np.concatenate(after) - np.concatenate([x, mu]))[:kept]
        return float(in_round_offs(gap, errors[:kept]))


def _gap(equations: StepEquations, seed: int, shorter: int, unit: int = 0) -> float:
    """Return how far apart the maps of L_d* and L_d are at a random point, like `_gap_of_map`."""
    s, numbers = equations.s, arithmetic(DIGITS)
    point = random_point([*s.x, *s.u, s.h, *s.parameter_list], (*s.u, s.h), seed)
    point[s.h] /= shorter
    for letter in [*s.x, *s.u] if unit else ():
        point[letter] *= sympy.Integer(10) ** unit
    with numbers.working():

        def geometry(sign: int) -> StepMap:
            parameters = [point[e] for e in s.parameter_list]
            q = s.q_values(sign * point[s.h], parameters, numbers)
            return StepMap(equations, numbers, q)

        back = -equations.groupoid.inversion(s.x, s.u, s.h).xreplace(point)
        x, u, v = (np.array([numbers.number(e) for e in w], numbers.dtype)
                   for w in (s.x.xreplace(point), s.u.xreplace(point), back))  # fmt: skip
        one, other = geometry(1), geometry(-1)
        target, *here = one.with_round_off(x, u, 0 * abs(x), 0 * abs(u))
        _, *there = other.with_round_off(target.value, v, target.error, abs(v))
        gaps = [a - b for a, b in zip(here, reversed(there), strict=True)]
        bounds = [part.error for part in gaps]
        return float(in_round_offs(np.concatenate([e.value for e in gaps]), np.concatenate(bounds)))
