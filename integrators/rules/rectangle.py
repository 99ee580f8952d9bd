"""The rectangle rule, of order 1 and with one point of each step: its start."""

from __future__ import annotations

from ..numbers.types import Column, Expression, Letter
from .discretisation import GroupoidForRule, LagrangianForRule, discretisation


@discretisation(order=1, source="paper, section 3.7 (heavy top): L_d = h L(x, u)")
def rectangle(
    L: LagrangianForRule, G: GroupoidForRule, x: Column, u: Column, h: Letter
) -> Expression:
    """The Lagrangian at the start of the step; symplectic Euler on the pair groupoid."""
    return h * L(x, u)
