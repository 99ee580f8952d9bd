"""The implicit-explicit rule, of order 2: a fast potential at the middle, the rest at both ends."""

from __future__ import annotations

from ..numbers.types import Column, Expression, Letter
from .discretisation import GroupoidForRule, LagrangianForRule, discretisation


@discretisation(
    order=2,
    splits=True,
    source="Stern, Grinspun, Multiscale Model. Simul. 7 (2009), 3: implicit-explicit, variational; "
    "McLachlan, Stern, SIAM J. Numer. Anal. 52 (2014): a modified trigonometric integrator",
)
def imex(L: LagrangianForRule, G: GroupoidForRule, x: Column, u: Column, h: Letter) -> Expression:
    """The fast part of the potential at the middle of the step, all else by the trapezoidal rule.

    Linearly implicit where the fast part is quadratic: its step is never bound by the fast
    frequency alone.
    """
    y = G.target(x, u, h)
    slow = L(x, u) + L.fast(x) + L(y, u) + L.fast(y)
    return h * slow / 2 - h * L.fast(G.target(x, u, h / 2))
