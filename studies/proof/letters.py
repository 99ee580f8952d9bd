"""A rule with letters for its irrational and its open numbers, and what is said of the others.

The step is derived once in these letters, and evaluated at their images in a field.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import wraps
from typing import Any

from discmech.integrators import BadInput, Discretisation
from discmech.integrators.errors import CannotMeasure, at_line
from discmech.integrators.numbers import sympy
from discmech.integrators.numbers.types import Expression

from .constants import Algebraic, Open

#: a fraction with such a power of two as its denominator was written as a float
BINARY = 2**20


@dataclass
class Told:
    """What was seen in the formula of a rule: open numbers, floats, and derivatives of L.

    taken: the most derivatives of L in it, infinite where they are not known; most: those for which
    the polynomials of the scenes have the degree, None where nothing is refused.
    """

    open: list[str] = field(default_factory=list)
    floats: list[Any] = field(default_factory=list)
    derivatives: bool = False
    taken: float = 0
    most: float | None = None

    @property
    def notes(self) -> list[str]:
        """Sentences on floats."""
        few = [f"{float(e)!r} is {e}" for e in self.floats[:3]]
        said = "floats in the rule have their exact binary values: " + ", ".join(few)
        return [said + ("." if len(self.floats) <= 3 else ", …")] if few else []


def lettered(rule: Discretisation, told: Told) -> Discretisation:
    """Return the rule with letters (`constants`) for its numbers; told: gets what is seen.

    Raises `BadInput`, when it is called, for a rule that gives another value each time.
    """
    if rule.method is not None:
        return replace(rule, base=lettered(rule.base, told))  # type: ignore[call-arg, attr-defined]
    formula, free = rule.formula, rule.parameters
    names = [name for name in free if name in inspect.signature(formula).parameters]

    @wraps(formula)
    def with_letters(first: Any, *rest: Any) -> Any:
        # a rule asks its second argument, the groupoid, for letters, and a map the system
        constant = (first if not hasattr(rest[0], "constant") else rest[0]).constant
        given = {name: sympy.Symbol(name, real=True) for name in names}
        if hasattr(first, "parameters"):
            own = {name: sympy.Symbol(name, real=True) for name in free}
            first.parameters.__dict__.update(own)
        for name in ("gradient", "mass", "df", "flow"):
            if hasattr(first, name):
                setattr(first, name, _watched(getattr(type(first), name), first, told))
        value, again = formula(first, *rest, **given), formula(first, *rest, **given)
        if value != again:
            raise BadInput(
                f"{at_line(formula)}{rule.name} gives another value each time it is called: write "
                "it without random numbers."
            )
        if hasattr(first, "potential"):
            told.taken = max(told.taken, _derivatives(formula, _AnyLagrangian(first), rest, given))
            if told.most is not None and told.taken > told.most:
                raise CannotMeasure(
                    f"{rule.name} takes {_counted(told.taken)} derivatives of L itself, and these "
                    "polynomials have the degree for fewer."
                )
        return _each(value, lambda e: _lettered(e, constant, free, told))

    return replace(rule, formula=with_letters, parameters=())


def _watched(method: Callable[..., Any], of: Any, told: Told) -> Callable[..., Any]:
    """Return a method that tells when it is called."""

    def called(*given: Any) -> Any:
        told.derivatives = True
        return method(of, *given)

    return called


class _AnyLagrangian:
    """A Lagrangian without a formula: what a rule differentiates stays a derivative of it."""

    def __init__(self, of: Any) -> None:
        self.s, self.parameters = of.s, of.parameters
        self.fast = lambda x: sympy.Function("fast", real=True)(*x)

    def __call__(self, x: Any, u: Any) -> Expression:
        return sympy.Function("L", real=True)(*x, *u)

    def potential(self, x: Any) -> Expression:
        return -self(x, 0 * self.s.u)

    def gradient(self, x: Any) -> Any:
        return self._at(x, sympy.Matrix([self.potential(self.s.x).diff(e) for e in self.s.x]))

    def mass(self, x: Any) -> Any:
        slopes = sympy.hessian(self(self.s.x, self.s.u), list(self.s.u))
        return self._at(x, slopes.subs(dict.fromkeys(self.s.u, 0)))

    def _at(self, x: Any, matrix: Any) -> Any:
        return matrix.subs(dict(zip(self.s.x, x, strict=True)), simultaneous=True)


def _derivatives(formula: Callable[..., Any], L: Any, rest: Any, given: Any) -> float:
    """Return the most derivatives of L in a factor of a rule; infinite if it needs L's formula.

    A difference of values over h^q is one, of q + 1 derivatives in a weight h.
    """
    try:
        value, h = sympy.sympify(formula(L, *rest, **given)).doit(), rest[-1]
        poles = [-int(e.exp) for e in value.atoms(sympy.Pow) if e.base == h and e.exp < 0]
        of_differences = 1 + max(poles) if poles else 0
        taken = max((_depth(e) for e in value.atoms(sympy.Derivative)), default=0)
        return float(max(taken, of_differences))
    except Exception:  # a rule may do anything with an expression, as look for its factors
        return float("inf")


def _depth(e: Any) -> Any:
    return e.derivative_count + max(map(_depth, e.expr.atoms(sympy.Derivative)), default=0)


def _counted(taken: float) -> str:
    return "an unknown number of" if taken == float("inf") else f"{taken:.0f}"


def _each(value: Any, change: Callable[[Any], Any]) -> Any:
    """Return the value of a rule, or the columns of a map, with each expression changed."""
    if isinstance(value, list | tuple):
        return type(value)(_each(e, change) for e in value)
    return value.applyfunc(change) if hasattr(value, "applyfunc") else change(value)


def _lettered(
    e: Any, constant: Callable[..., Any], names: tuple[str, ...], told: Told
) -> Expression:
    try:
        e = sympy.sympify(e, strict=True)
        parts = sympy.preorder_traversal(e)
    except (sympy.SympifyError, TypeError, AttributeError):
        return e  # the bench says what is wrong with it
    swap: dict[Any, Any] = {}
    for part in parts:
        if part in swap:
            parts.skip()
        elif isinstance(part, sympy.Symbol):
            if part.name in names or part.is_real is None:
                told.open += [part.name] * (part.name not in told.open)
                swap[part] = constant(Open(part.name))
        elif part.is_Rational or part.is_Float:
            number = sympy.Rational(part)
            if number.q >= BINARY and number.q & (number.q - 1) == 0 and number not in told.floats:
                told.floats.append(number)
        elif getattr(part, "is_number", False) and part.is_finite and part.is_real:
            swap[part] = constant(Algebraic(part))
            parts.skip()
    return e.xreplace(swap) if swap else e
