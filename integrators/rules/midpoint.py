"""The midpoint rule, of order 2 and with one point of each step: its middle."""

from __future__ import annotations

from ..numbers.types import Column, Expression, Letter
from .discretisation import GroupoidForRule, LagrangianForRule, discretisation


@discretisation(order=2, source="paper, section 3.6.1: the implicit midpoint rule")
def midpoint(
    L: LagrangianForRule, G: GroupoidForRule, x: Column, u: Column, h: Letter
) -> Expression:
    """The Lagrangian at the middle of the step."""
    return h * L(G.target(x, u, h / 2), u)
