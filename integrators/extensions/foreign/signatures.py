"""The arguments of a black box's functions: all wanted ones, or all but the last."""

from __future__ import annotations

import inspect

from ...errors import BadInput, at_line, signature_of
from ...numbers.types import Function

#: the names of a class's methods that begin, continue and read its memory
METHODS = {"start": "(q, p, h, system)", "step": "(state, h, system)", "read": "(state, system)"}


def functions_of(
    formula: Function, runs: bool, is_map: bool = False
) -> dict[str, tuple[Function, str, int]]:
    """Return each function of a box by name: itself, its arguments, and 1 if `self` is one more.

    is_map: True for a map of one step, which takes no h.
    """
    if not inspect.isclass(formula):
        wanted = "(q, p, h, steps, every, system)" if runs else "(q, p, h, system)"
        wanted = "(q, p, system)" if is_map else wanted
        return {"the function": (formula, wanted, 0)}
    return {
        name: (getattr(formula, name), wanted,
               int(not isinstance(inspect.getattr_static(formula, name), staticmethod)))
        for name, wanted in METHODS.items()
    }  # fmt: skip


def takes_system(function: Function, wanted: str, bound: int = 0) -> bool:
    """Return True if a function also takes the last wanted argument, the scene in numbers."""
    full = wanted.count(",") + 1 + bound
    return _counts(function)[1] >= full


def check_arguments(what: str, function: Function, wanted: str, bound: int = 0) -> None:
    """Raise `BadInput` unless it can be called with the wanted arguments, or all but the last."""
    full = wanted.count(",") + 1 + bound
    least, most = _counts(function)
    what = f"{at_line(function)}{what}"
    if named := _only_named(function):
        raise BadInput(
            f"{what} takes {named} by name alone, but is called as "
            f"{wanted}: leave out the * before it, or give it a default."
        )
    if least <= full and most >= full - 1:
        return
    some = least - bound if least == most else f"{least - bound} to {most - bound}"
    raise BadInput(
        f"{what} takes {some} arguments, but is called as {wanted}, where system may be left out."
    )


def _only_named(function: Function) -> str:
    """Return the arguments that must be given by name, or ""."""
    signature = signature_of(function)
    arguments = signature.parameters.values() if signature else ()
    return ", ".join(p.name for p in arguments if p.kind is p.KEYWORD_ONLY and p.default is p.empty)


def _counts(function: Function) -> tuple[int, float]:
    """Return the least and the largest number of positional arguments."""
    signature = signature_of(function)
    if signature is None:
        return 0, float("inf")
    entries = signature.parameters.values()
    plain = [p for p in entries if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    least = sum(p.default is p.empty for p in plain)
    return least, float("inf") if any(p.kind is p.VAR_POSITIONAL for p in entries) else len(plain)
