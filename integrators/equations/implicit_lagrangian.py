"""Rules on a Hamiltonian whose Lagrangian has no closed form: momenta as unknowns of the step.

l(x, v) is the stationary value of μ·v − H(x, μ) in μ (the Legendre transform). Each value of l in a
rule adds one stage, that μ, and L_d is stationary in all of them (Leok, Zhang 2011, section 3, have
this Hamilton–Pontryagin form): nothing else changes.
"""

from __future__ import annotations

from dataclasses import replace

from ..errors import BadInput, CannotMeasure
from ..numbers import sympy
from ..numbers.types import Column, Expression, Letter
from ..rules import Discretisation
from .rule_view import GroupoidForRule, LagrangianForRule
from .symbols import SceneSymbols


class _Stationary:
    """The Lagrangian for a rule: each value of it has the next of some columns as its μ.

    Without columns, the values are only counted (`asked`).
    """

    offers = "L of a Hamiltonian without a closed Lagrangian has L(x, u) and parameters"

    def __init__(self, s: SceneSymbols, columns: list[Column] | None = None) -> None:
        self.s, self.parameters, self.columns, self.asked = s, s.parameters, columns, 0

    def __call__(self, x: Column, u: Column) -> Expression:
        self.asked += 1
        if self.columns is None:
            return sympy.Integer(0)
        mu = self.columns[self.asked - 1]
        return mu.dot(u) - self.s.hamiltonian_at(x, mu)


def with_momenta(s: SceneSymbols, rule: Discretisation) -> Discretisation:
    """Return the rule with one more stage for each value of the Lagrangian in it.

    Raises `CannotMeasure` if it needs more than values.
    """
    counted = _Stationary(s)
    try:
        stages = [[0 * s.u] * rule.stages] if rule.stages else []
        rule.formula(counted, GroupoidForRule(s), s.x, s.u, s.h, *stages)
    except (AttributeError, BadInput) as error:
        raise CannotMeasure(
            f"{s.name}: {rule.name} asks for more than values of the Lagrangian ({error}), which "
            "is not known in closed form of its Hamiltonian; take another rule."
        ) from error
    own = rule.stages

    def formula(
        L: LagrangianForRule, G: GroupoidForRule, x: Column, u: Column, h: Letter, s: list[Column]
    ) -> Expression:
        own_stages = [s[:own]] if own else []
        return rule.formula(_Stationary(L.s, s[own:]), G, x, u, h, *own_stages)

    formula.__wrapped__ = rule.formula  # type: ignore[attr-defined]  # whose lines messages name
    return replace(rule, formula=formula, stages=own + counted.asked, nodes=None)
