"""Self-adjointness of a scheme, derived from its Legendre maps.

The adjoint of Φ has the discrete Lagrangian L_d*(g; h) = −L_d(g⁻¹; −h), whose Legendre maps are
F⁻*(g; h) = −F⁺(g⁻¹; −h) and F⁺*(g; h) = −F⁻(g⁻¹; −h) in the charts of the steps h and −h.
"""

from __future__ import annotations

from functools import lru_cache

from ..equations import DiscreteEquations
from ..numbers import arithmetic, random_point
from .local_geometry import LocalGeometry

DIGITS = 50


@lru_cache(maxsize=512)
def is_self_adjoint(equations: DiscreteEquations) -> bool:
    """Whether the Legendre maps of L_d* and L_d agree: Φ₋ₕ is then the inverse of Φₕ.

    Decided at two random points to 40 of 50 digits (`identities`), in x, u, h and the
    parameters; internal stages are solved for.
    """
    return all(_gap(equations, seed) < 10.0**-40 for seed in range(2))


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
        here = geometry(1).at(x, u)
        there = geometry(-1).at(here["target"], v)
        pairs = [(here[a], there[b]) for a, b in (("minus", "plus"), ("plus", "minus"))]
        return float(max(max(abs(a + b)) / max(abs(a)) for a, b in pairs))
