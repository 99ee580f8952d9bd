"""The trapezoidal rule, of order 2 and with two points of each step: both ends."""

from __future__ import annotations

from ..numbers.types import Column, Expression, Letter
from .discretisation import GroupoidForRule, LagrangianForRule, discretisation


@discretisation(order=2, source="paper, section 3.6.1: Störmer–Verlet")
def trapezoidal(
    L: LagrangianForRule, G: GroupoidForRule, x: Column, u: Column, h: Letter
) -> Expression:
    """The mean of the Lagrangian at both ends of the step."""
    return h * (L(x, u) + L(G.target(x, u, h), u)) / 2
