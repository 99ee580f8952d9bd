"""Self-adjointness of a scheme, derived from its Legendre maps.

The adjoint of Φ has the discrete Lagrangian L_d*(g; h) = −L_d(g⁻¹; −h), whose Legendre maps are
F⁻*(g; h) = −F⁺(g⁻¹; −h) and F⁺*(g; h) = −F⁻(g⁻¹; −h) in the charts of the steps h and −h.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from ..equations import ConstrainedEquations, DiscreteEquations, OneStepEquations
from ..numbers import arithmetic, random_point
from .local_geometry import LocalGeometry
from .one_step_geometry import OneStepGeometry

DIGITS = 50


@lru_cache(maxsize=512)
def is_self_adjoint(equations: DiscreteEquations) -> bool:
    """Whether the Legendre maps of L_d* and L_d agree: Φ₋ₕ is then the inverse of Φₕ.

    Decided at two random points to 40 of 50 digits (`identities`), in x, u, h and the
    parameters; internal stages are solved for. A one-step map is stepped to and fro instead.
    """
    if isinstance(equations, ConstrainedEquations):
        return equations.symmetric and is_self_adjoint(equations.discrete)
    gap = _gap_of_map if isinstance(equations, OneStepEquations) else _gap
    return all(gap(equations, seed) < 10.0**-40 for seed in range(2))


def order_of_step(rule: Any, equations: Any, self_adjoint: Callable[[], bool]) -> int | None:
    """The order in (x, μ) that a rule of one step has with its equations; None if it states none.

    A self-adjoint method has even order (Hairer, Lubich, Wanner, II.3): so the rectangle rule gains
    one wherever it turns out self-adjoint, as on a group, where every rule is h·l(u).
    """
    order, groupoid = rule.order, equations.groupoid
    every_chart = groupoid.symmetric_chart or equations.of.G.gave_velocities
    if order is not None and order > 1 and not every_chart:
        return 1  # u is not the velocity of the middle of the step
    if order is None or order % 2 == 0:
        return None if order is None else int(order)
    return int(order) + (groupoid._inversion is not None and self_adjoint())


def _gap_of_map(equations: Any, seed: int) -> float:
    """‖Φ₋ₕ(Φₕ(z)) − z‖ of a one-step map at a random z, relative to the step."""
    s, numbers = equations.s, arithmetic(DIGITS)
    point = random_point([*equations.z, s.h, *s.parameter_list], [s.h], seed)
    with numbers.working():
        x, mu = (np.array([numbers.number(point[e]) for e in part], numbers.dtype)
                 for part in (s.x, s.mu))  # fmt: skip
        after = x, mu
        for sign in (1, -1):
            parameters = [point[e] for e in s.parameter_list]
            q = s.q_values(sign * point[s.h], parameters, numbers)
            geometry = OneStepGeometry(equations, numbers, q)
            start = geometry.start(*after, near=0 * mu)
            moved = np.concatenate(after)
            *after, _ = geometry.step(*after, start)  # type: ignore[assignment]
        ends = [np.concatenate(part) for part in ((x, mu), after)]
        return float(max(abs(ends[1] - ends[0])) / max(abs(moved - ends[0])))


def _gap(equations: DiscreteEquations, seed: int) -> float:
    """The largest difference of the maps of L_d* and L_d at a random point, relative to them."""
    s, numbers = equations.s, arithmetic(DIGITS)
    point = random_point([*s.x, *s.u, s.h, *s.parameter_list], (*s.u, s.h), seed)
    with numbers.working():

        def geometry(sign: int) -> LocalGeometry:
            parameters = [point[e] for e in s.parameter_list]
            q = s.q_values(sign * point[s.h], parameters, numbers)
            return LocalGeometry(equations, numbers, q)

        back = -equations.groupoid.inversion(s.x, s.u, s.h).xreplace(point)
        x, u, v = ([numbers.number(e) for e in w]
                   for w in (s.x.xreplace(point), s.u.xreplace(point), back))  # fmt: skip
        target, *here = geometry(1).values(x, u)
        _, *there = geometry(-1).values(target, v)
        pairs = zip(here, reversed(there), strict=True)
        # both maps vanish where L_d is 0, as of a lattice's bond that has constraints alone
        return float(max(max(abs(a + b)) / (max(abs(a)) or 1) for a, b in pairs))
