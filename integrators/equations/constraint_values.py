"""What constraints make vanish, from the scene's own functions: what steps are held against.

Nothing here is made of the rows that a step solves.
"""

from __future__ import annotations

from ..numbers import sympy
from ..numbers.types import Column
from .constraints import constraint, constraint_matrix
from .discrete_lagrangian import DiscreteLagrangian
from .rule_view import written
from .symbols import SceneSymbols, column


def vanishing_at_states(s: SceneSymbols) -> Column:
    """φ(x), where it is holonomic, and A(x) ξ of the velocity at x, in (x, ξ = v)."""
    found = constraint(s, s.x) if s.holonomic else sympy.zeros(0, 1)
    return found.col_join(constraint_matrix(s, s.x) * s.v)


def vanishing_in_a_step(of: DiscreteLagrangian) -> Column:
    """Σ ω_i/h A(x_i) u over the points x_i where a rule asks for L with the weights ω_i, in (x, u).

    Only of a nonholonomic scene: a holonomic one asks nothing of the way (0×1).
    """
    s, n = of.s, len(of.s.x)
    if s.holonomic:
        return sympy.zeros(0, 1)
    terms = [
        written(weight) / s.h * constraint_matrix(s, column(map(written, call.args[:n]))) * s.u
        for weight, call in of.asked
    ]
    return sum(terms[1:], terms[0])
