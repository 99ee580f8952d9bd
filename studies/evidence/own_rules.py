"""The rules by which exact steps are made: the evidence's own, and none of those that are judged.

So a rule of the bench that is changed changes its own verdicts alone, and a wrong one misleads no
other. All are self-adjoint, and extrapolated or composed.
"""

from __future__ import annotations

from discmech.integrators.numbers.types import Column, Expression, Letter
from discmech.integrators.rules import compose, discretisation
from discmech.integrators.rules.discretisation import GroupoidForRule, LagrangianForRule


@discretisation(order=2)
def trapezoidal(
    L: LagrangianForRule, G: GroupoidForRule, x: Column, u: Column, h: Letter
) -> Expression:
    """The mean of L at both ends."""
    return h / 2 * (L(x, u) + L(G.target(x, u, h), u))


@discretisation(order=2)
def midpoint(
    L: LagrangianForRule, G: GroupoidForRule, x: Column, u: Column, h: Letter
) -> Expression:
    """L in the middle."""
    return h * L(G.target(x, u, h / 2), u)


#: of order 8, for long runs, and to check a reference, with which it shares no formula
WITNESS = compose(trapezoidal, "kahan-li-8")
