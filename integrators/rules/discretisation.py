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

from ..errors import BadInput
from ..numbers.types import Column, Expression, Letter
from .quadrature import GaussNodes


@dataclass(frozen=True)
class Discretisation:
    """A rule L_d(x, u; h) = formula(L, G, x, u, h).

    `L(x, u)` is the Lagrangian (its parameters are `L.parameters`), `G` the groupoid, x and u sympy
    columns, h the step. `order` may be None: then it is only measured.

    With `stages` = k the rule is L_d(x, u, s; h) = formula(L, G, x, u, h, s), s a list of k columns
    m×1, and L_d(x, u; h) its stationary value in s. Newton starts at s = 0: let that be the
    straight path.
    """

    name: str
    formula: Callable[..., Any]
    order: int | None = None
    source: str = ""
    stages: int = 0
    splits: bool = False  # it treats the scene's fast potential L.fast(x) apart
    #: where L_d is that of a polynomial with as many Gauss nodes as its degree: collocation
    gauss_nodes: GaussNodes | None = None

    def applies(self, scene: Any) -> bool:
        """Whether the scene has all that the rule needs; `own` needs a discrete Lagrangian."""
        if (scene.discrete_lagrangian is not None) != (self.formula is own.formula):
            return False
        return scene.fast is not None or not self.splits

    def refusal(self, scene: Any) -> str:
        """Why the rule has no meaning for the scene, a sentence; empty where none is needed."""
        return ""

    def __call__(
        self, L: Any, G: Any, x: Column, u: Column, h: Letter, *s: list[Column]
    ) -> Expression:
        return self.formula(L, G, x, u, h, *s)


def discretisation(
    order: int | None = None,
    *,
    name: str | None = None,
    source: str = "",
    stages: int = 0,
    splits: bool = False,
) -> Callable[[Callable[..., Any]], Discretisation]:
    """Decorator: make a rule of a function (L, G, x, u, h), or (L, G, x, u, h, s) with stages.

    `splits`: the rule treats the scene's fast potential, L.fast(x), apart. Raises `BadInput` if the
    order is no positive whole number, stages no whole number from 0, or the arguments are others.
    """
    if callable(order):
        raise BadInput("write @discretisation() with brackets, or @discretisation(order=2).")
    if order is not None and (type(order) is not int or order < 1):
        raise BadInput(f"the order of a rule is a whole number from 1, not {order!r}.")
    if type(stages) is not int or stages < 0:
        raise BadInput(f"the internal stages of a rule are a whole number from 0, not {stages!r}.")

    def make(formula: Callable[..., Any]) -> Discretisation:
        if not callable(formula):
            raise BadInput(f"a rule is a function (L, G, x, u, h), not {formula!r}.")
        count = len(inspect.signature(formula).parameters)
        label = str(name or getattr(formula, "__name__", "rule").replace("_", "-"))
        if count != 5 + (stages > 0):
            wanted = "six: (L, G, x, u, h, s)" if stages else "five: (L, G, x, u, h)"
            raise BadInput(
                f"rule {label}: the function takes {count} arguments, but a rule "
                f"{'with stages ' if stages else ''}takes {wanted}."
            )
        if not re.fullmatch(r"[\w.-]{1,80}", label):
            raise BadInput(f"a rule's name is {label!r}: use letters, digits, dots and dashes.")
        about = source or inspect.getdoc(formula) or ""
        return Discretisation(label, formula, order, about, stages, splits)

    return make


def _given(L: Any, G: Any, x: Column, u: Column, h: Letter) -> Expression:
    return L.discrete(x, u, h)


#: the discrete Lagrangian that a scene gives itself (`Scene.discrete_lagrangian`)
own = Discretisation("own", _given, source="the scene's")
