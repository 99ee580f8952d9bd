"""Numbers that a rule leaves open, and rules with values for them."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import replace
from functools import wraps
from typing import Any, TypeVar

from ..errors import BadInput, shown, unknown
from ..numbers import exact, sympy, to_sympy
from ..numbers.types import Function

_Rule = TypeVar("_Rule", bound=Any)  # a `Discretisation`, which imports this file

#: what a rule or a map is given, and the parts of these
_LETTERS = ("L", "G", "x", "u", "h", "s", "z", "Z", "K", "c")


def open_numbers(parameters: object) -> dict[str, Any]:
    """Return names of open numbers ↦ their values, None without one.

    Raises `BadInput` for what are no names, and for values that are no numbers.
    """
    entries: Any = (parameters,) if isinstance(parameters, str) else parameters
    several = isinstance(entries, list | tuple | Mapping)
    if several and (taken := [e for e in entries if e in _LETTERS]):
        raise BadInput(
            f"the parameters of a rule are {shown(parameters)}, but {taken[0]} is one of the "
            f"letters of rules ({', '.join(_LETTERS)}): choose another name for it."
        )
    if not several or not all(isinstance(e, str) and e.isidentifier() for e in entries):
        raise BadInput(
            f"the parameters of a rule are {shown(parameters)}: give names of numbers that stay "
            'open, such as parameters=("w",), or their values, parameters={"w": "1/6"}.'
        )
    if not isinstance(entries, Mapping):
        return dict.fromkeys(entries)
    return {name: exact(value, f"the parameter {name}") for name, value in entries.items()}


def with_parameters(rule: _Rule, values: Mapping[str, Any], name: str | None = None) -> _Rule:
    """Return a rule with values for numbers that it leaves open.

    values: exact numbers, or expressions of sympy. The name of the new rule has the values, unless
    one is given. Raises `BadInput` for a number that the rule does not leave open.
    """
    known: dict[str, Any] = dict(getattr(rule.formula, "bound", (rule, {}))[1])
    first = getattr(rule.formula, "bound", (rule, {}))[0]
    for each in values:
        if each not in first.parameters:
            raise unknown(f"open number of {rule.name}", each, first.parameters)
    known |= {each: value if isinstance(value, sympy.Basic) else to_sympy(exact(value, each))
              for each, value in values.items()}  # fmt: skip
    label = ",".join(f"{each}={value}" for each, value in known.items())
    return replace(
        first, name=name or f"{first.name}:{label}", formula=_bound(first, known),
        parameters=tuple(e for e in first.parameters if e not in known),
    )  # fmt: skip


def of_scene(rule: _Rule) -> _Rule:
    """Return a rule that takes its open numbers from the parameters of these names of a scene."""
    return replace(rule, formula=_bound(rule, {}), parameters=())


def _bound(rule: Any, known: Mapping[str, Any]) -> Function:
    """Return the formula of a rule with these values, and those of the scene for the others."""
    formula = rule.formula
    wanted = inspect.signature(formula).parameters
    missing = [each for each in rule.left_open if each not in known]

    @wraps(formula)
    def bound(*arguments: Any) -> Any:
        scene = {e: getattr(arguments[0].parameters, e) for e in missing}
        values = {**known, **scene}
        value = formula(*arguments, **{e: values[e] for e in values if e in wanted})
        return _replaced(value, {sympy.Symbol(e): values[e] for e in values})

    if known:
        bound.bound = (rule, known)  # type: ignore[attr-defined]
    return bound


def of_decorator(rule: _Rule, parameters: Mapping[str, Any]) -> _Rule:
    """Return the rule that a decorator makes: with those values that it was given."""
    values = {name: value for name, value in parameters.items() if value is not None}
    return with_parameters(rule, values, rule.name) if values else rule


def _replaced(value: Any, letters: Mapping[Any, Any]) -> Any:
    """Return the value of a rule, or the columns of a map, with values in place of letters."""
    if isinstance(value, list | tuple):
        return type(value)(_replaced(e, letters) for e in value)
    return value.subs(letters) if hasattr(value, "subs") else value
