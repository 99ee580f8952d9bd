"""Declarations of a scene beside its Lagrangian: conserved quantities, L_d on a group."""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from functools import partial
from typing import Any, Literal, get_args

from ..errors import BadInput, check_function, names_checked, shown, signature_of
from ..numbers import sympy, without_text
from ..numbers.types import Column, Covector, Function, Given, Parameters, Point, Scalar

Kind = Literal["momentum map", "Casimir", "first integral", "nonholonomic momentum"]


@names_checked
@dataclass(frozen=True)
class Conserved:
    """A quantity formula(x, mu, p) or formula(x, mu, p, h) → an expression, a column or a list.

    x (n×1) and mu (m×1, natural basis: μ = F/h) are sympy columns, p the parameters, h the step.
    One that takes h has to be kept at every step, one that does not at the scene's own step.
    With `attitude` the scene is a group's and x is the attitude as an N×N matrix. With `value` the
    quantity is a constraint: the start must have exactly this value (|Γ|² = 1). With `stretch` it
    is compared over that many steps at a time, and the attitude starts again at e: an attitude that
    grows exponentially (SL(2)) loses its digits over a whole run. A "nonholonomic momentum" ⟨μ,
    ξ(x)⟩ with A(x) ξ(x) = 0 changes in a step by a known amount, so its drift need not be 0.
    """

    name: str
    formula: Function
    kind: Kind = "momentum map"
    attitude: bool = False
    value: Given = None
    stretch: int | None = None

    def __post_init__(self) -> None:
        check_function(self.formula, self.name, "(x, mu, p)", "(x, mu, p, h)")
        kinds = get_args(Kind)
        if not isinstance(self.kind, str) or self.kind not in kinds:
            near = get_close_matches(shown(self.kind), kinds, 1, 0.5)
            say = f"did you mean {shown(near[0])}?" if near else f"there are {', '.join(kinds)}."
            raise BadInput(f"{self.name}: there is no kind={shown(self.kind)}: {say}")

    @property
    def of_step(self) -> bool:
        """True if the quantity depends on the step h: a fourth argument without a default."""
        return takes_fourth(self.formula)

    def at(self, x: Point, mu: Covector, p: Parameters, h: Scalar) -> Scalar | Column:
        """Return the quantity of sympy columns x, mu, parameters p and step h; lists as columns."""
        value = self.formula(x, mu, p, h) if self.of_step else self.formula(x, mu, p)
        value = without_text(value, f"the conserved quantity {self.name}")
        return sympy.Matrix(value) if isinstance(value, list | tuple) else value

    @property
    def to_roundoff(self) -> bool:
        """True if a variational integrator conserves it, or obeys its equation, to round-off."""
        return self.kind != "first integral"


@dataclass(frozen=True)
class OnGroup:
    """A discrete Lagrangian formula(x, g, h, p): x (n×1) and g (N×N) are sympy matrices.

    `branch(x, g, h, p)`: a number that distinguishes the solutions of F⁻(x, g) = hμ; the one with
    the number nearest to the last step's is taken. By default it is L_d itself. `kept`: True if the
    map conserves that number exactly, so that any change shows a wrong branch. `order`: the order
    of the method in (x, μ), if known.
    """

    formula: Function
    branch: Function | None = None
    kept: bool = False
    order: int | None = None


def takes_fourth(function: Function | None) -> bool:
    """Return True if a function of three arguments also has a fourth without a default.

    The fourth is the time, or the step.
    """
    return arguments_of(function) == 4


def arguments_of(function: Function | None) -> int:
    """Return the number of a function's positional arguments without default; 0 if unknown."""
    signature = None if function is None else signature_of(function)
    parameters = signature.parameters.values() if signature else ()
    return sum(p.kind < p.VAR_POSITIONAL and p.default is p.empty for p in parameters)


def on_group(
    formula: Function | None = None,
    *,
    branch: Function | None = None,
    kept: bool = False,
    order: int | None = None,
) -> Any:
    """Mark formula(x, g, h, p) as given on the group; with options it is a decorator."""
    make = partial(OnGroup, branch=branch, kept=kept, order=order)
    return make if formula is None else make(formula)
