"""Adjoint and self-adjointness of a scheme, derived from its Legendre maps.

The adjoint of Φ has the discrete Lagrangian L_d*(g; h) = −L_d(g⁻¹; −h), whose Legendre maps are
F⁻*(g; h) = −F⁺(g⁻¹; −h) and F⁺*(g; h) = −F⁻(g⁻¹; −h) in the charts of the steps h and −h.
"""

from __future__ import annotations

from typing import Any

from ..equations import DiscreteEquations
from ..numbers import arithmetic, random_point
from .local_geometry import LocalGeometry

DIGITS = 50


def is_self_adjoint(scheme: DiscreteEquations) -> bool:
    """Whether L_d* and L_d have the same Legendre maps: Φ₋ₕ is then the inverse of Φₕ.

    Decided at two random points to 40 of 50 digits (`identities`), in x, u, h and the
    parameters; internal stages are solved for.
    """
    return all(_gap(scheme, seed) < 10.0**-40 for seed in range(2))


def _gap(scheme: DiscreteEquations, seed: int) -> float:
    groupoid, s, numbers = scheme.scene.groupoid, scheme.s, arithmetic(DIGITS)
    letters = [*s.x, *s.u, s.h, *s.parameter_list]
    point = random_point(letters, (*s.u, s.h), seed)
    with numbers.working():
        back = -groupoid.inversion(s.x, s.u, s.h).xreplace(point)
        u = [point[e] for e in s.u]

        def geometry(sign: int) -> LocalGeometry:
            p = [point[e] for e in s.parameter_list]
            constants = s.q_values(1, numbers)[1 + len(p) :]
            values = [numbers.number(v) for v in (sign * point[s.h], *p)]
            return LocalGeometry(scheme, numbers, [*values, *constants])

        here = geometry(1).at(
            *([numbers.number(e) for e in v] for v in ([point[e] for e in s.x], u))
        )
        there = geometry(-1).at(here["target"], [numbers.number(e) for e in back])
        gap: Any = 0
        for one, other in (("minus", "plus"), ("plus", "minus")):
            size = max(abs(e) for e in here[one])
            gap = max(
                gap, *(abs(a + b) / size for a, b in zip(here[one], there[other], strict=True))
            )
    return float(gap)
