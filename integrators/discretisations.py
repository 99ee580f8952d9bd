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

from .errors import BadInput, unknown


@dataclass(frozen=True)
class Discretisation:
    """A rule L_d(x, u; h) = formula(L, G, x, u, h).

    `L(x, u)` is the Lagrangian (its parameters are `L.parameters`), `G` the groupoid, x and u sympy
    columns, h the step. `order` may be None: then it is only measured.

    With `stages` = k the rule is L_d(x, u, s; h) = formula(L, G, x, u, h, s), s a list of k columns
    of the length of u, and L_d(x, u; h) its stationary value in s. Newton's first guess is s = 0,
    so let that be the straight path.
    """

    name: str
    formula: Callable[..., Any]
    order: int | None = None
    source: str = ""
    stages: int = 0
    splits: bool = False  # it treats the scene's fast potential L.fast(x) apart

    def applies(self, scene: Any) -> bool:
        """Whether the scene has what the rule needs; `own` is for those that give L_d alone."""
        if (scene.discrete_lagrangian is not None) != (self.formula is own.formula):
            return False
        return scene.fast is not None or not self.splits

    def __call__(self, L: Any, G: Any, x: Any, u: Any, h: Any, *s: Any) -> Any:
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

    `splits`: it asks for the scene's fast potential, L.fast(x).

    Raises `BadInput` if the order is no positive whole number, stages no whole number from 0, or
    the function takes other arguments.
    """
    if callable(order):
        raise BadInput("write @discretisation() with brackets, or @discretisation(order=2).")
    if order is not None and (type(order) is not int or order < 1):
        raise BadInput(f"the order of a rule is a whole number from 1, not {order!r}.")
    if type(stages) is not int or stages < 0:
        raise BadInput(f"the internal stages of a rule are a whole number from 0, not {stages!r}.")

    def make(formula: Callable[..., Any]) -> Discretisation:
        count = len(inspect.signature(formula).parameters)
        label = name or formula.__name__.replace("_", "-")
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


@discretisation(
    order=2,
    splits=True,
    source="Stern, Grinspun, Multiscale Model. Simul. 7 (2009), 3: implicit-explicit, variational; "
    "McLachlan, Stern, SIAM J. Numer. Anal. 52 (2014): a modified trigonometric integrator",
)
def imex(L: Any, G: Any, x: Any, u: Any, h: Any) -> Any:
    """The fast part of the potential at the middle of the step, all else by the trapezoidal rule.

    Linearly implicit where the fast part is quadratic: its step is never bound by the fast
    frequency alone.
    """
    y = G.target(x, u, h)
    slow = L(x, u) + L.fast(x) + L(y, u) + L.fast(y)
    return h * slow / 2 - h * L.fast(G.target(x, u, h / 2))


def _given(L: Any, G: Any, x: Any, u: Any, h: Any) -> Any:
    raise BadInput("the rule own stands for the discrete Lagrangian that a scene gives itself.")


#: no rule: the discrete Lagrangian that a scene gives itself (`Scene.discrete_lagrangian`)
own = Discretisation("own", _given, source="the scene's")

BUILT_IN = {rule.name: rule for rule in (rectangle, midpoint, trapezoidal, imex)}


def names() -> tuple[str, ...]:
    """Names that `get` knows: the built-in rules, Galerkin rules, and a composition of each kind.

    gauss-N and lobatto-N have N nodes, up to 20; any rule can follow the colon of a composition.
    """
    from .composition import METHODS
    from .galerkin import FAMILIES

    galerkin = [
        f"{family}-{least + i}" for family, (_, least) in FAMILIES.items() for i in range(4)
    ]
    return (*BUILT_IN, *galerkin, *(f"{method}:trapezoidal" for method in METHODS))


def get(name: str) -> Discretisation:
    """The rule of that name: built in, gauss-N, lobatto-N, own, or a composition such as
    kahan-li-8:midpoint.

    Raises `BadInput` naming the nearest one.
    """
    if name in BUILT_IN or name == own.name:
        return BUILT_IN.get(name, own)
    if ":" in name:
        from .composition import compose

        method, base = name.split(":", 1)
        composed: Discretisation = compose(get(base), method)
        return composed
    family, _, nodes = name.rpartition("-")
    from .galerkin import FAMILIES

    if family in FAMILIES and nodes.isdecimal():
        return FAMILIES[family][0](int(nodes))
    raise unknown("rule", name, names())
