"""Discretisations: rules that turn a Lagrangian into a discrete Lagrangian.

A rule is data: a formula written with the groupoid's target, its order, its source. The point at
fraction θ of a step is b(x, u; θh), so one formula serves every groupoid.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from .errors import BadInput


@dataclass(frozen=True)
class Discretisation:
    """A rule L_d(x, u; h) = formula(L, G, x, u, h).

    `L(x, u)` is the Lagrangian (its parameters are `L.parameters`), `G` the groupoid, x and u sympy
    columns, h the step. `order` may be None: then it is only measured.
    """

    name: str
    formula: Callable[..., Any]
    order: int | None = None
    source: str = ""

    def __call__(self, L: Any, G: Any, x: Any, u: Any, h: Any) -> Any:
        return self.formula(L, G, x, u, h)


def discretisation(
    order: int | None = None, *, name: str | None = None, source: str = ""
) -> Callable[[Callable[..., Any]], Discretisation]:
    """Decorator: make a rule of a function (L, G, x, u, h).

    Raises `BadInput` if the order is no positive whole number or the function takes other
    arguments.
    """
    if callable(order):
        raise BadInput("write @discretisation() with brackets, or @discretisation(order=2).")
    if order is not None and (type(order) is not int or order < 1):
        raise BadInput(f"the order of a rule is a whole number from 1, not {order!r}.")

    def make(formula: Callable[..., Any]) -> Discretisation:
        count = len(inspect.signature(formula).parameters)
        label = name or formula.__name__.replace("_", "-")
        if not re.fullmatch(r"[\w.-]{1,80}", label):
            raise BadInput(f"a rule's name is {label!r}: use letters, digits, dots and dashes.")
        if count != 5:
            raise BadInput(
                f"rule {label}: the function takes {count} arguments, but a rule takes five: "
                "(L, G, x, u, h)."
            )
        return Discretisation(label, formula, order, source or inspect.getdoc(formula) or "")

    return make


@discretisation(order=1, source="paper, section 3.7 (heavy top): L_d = h L(x, u)")
def rectangle(L: Any, G: Any, x: Any, u: Any, h: Any) -> Any:
    """The Lagrangian at the start of the step; symplectic Euler on the pair groupoid."""
    return h * L(x, u)


@discretisation(order=2, source="paper, section 3.6.1: the implicit midpoint rule")
def midpoint(L: Any, G: Any, x: Any, u: Any, h: Any) -> Any:
    """The Lagrangian at the middle of the step."""
    return h * L(G.target(x, u, h / 2), u)


@discretisation(order=2, source="paper, section 3.6.1: Störmer–Verlet")
def trapezoidal(L: Any, G: Any, x: Any, u: Any, h: Any) -> Any:
    """The mean of the Lagrangian at both ends of the step."""
    return h * (L(x, u) + L(G.target(x, u, h), u)) / 2


BUILT_IN = {rule.name: rule for rule in (rectangle, midpoint, trapezoidal)}


def get(name: str) -> Discretisation:
    """The built-in rule of that name; raises `BadInput` naming the nearest ones."""
    from difflib import get_close_matches

    if name in BUILT_IN:
        return BUILT_IN[name]
    near = get_close_matches(name, BUILT_IN, 1)
    hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(BUILT_IN)}."
    raise BadInput(f'there is no rule "{name}": {hint}')
