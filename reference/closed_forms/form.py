"""The type of closed-form solutions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

Numbers = Sequence[Any]


@dataclass(frozen=True)
class Motion:
    """The state at one time, as mpf numbers: x, v and, if known, the attitude (mpmath matrix)."""

    x: list[Any]
    v: list[Any]
    attitude: Any = None


@dataclass(frozen=True)
class ClosedForm:
    """A closed-form solution and the system that it solves.

    ``motion(p, x0, v0, t)`` takes exact sympy numbers and evaluates at mpmath's working precision;
    ``applies(p, x0, v0)`` is True if these data are in its range, ``attitude`` is True if the
    motion has one.
    """

    name: str
    formula: str
    kind: str
    lagrangian: Callable[[Any, Any, Any], Any]
    motion: Callable[[Any, Numbers, Numbers, Any], Motion]
    applies: Callable[[Any, Numbers, Numbers], bool]
    basis: Callable[[], tuple[Any, ...]] | None = None
    attitude: bool = False


def is_zero(number: Any) -> bool:
    """Return True if an exact sympy number is zero: decided by value first, then symbolically."""
    import sympy  # a field's waves need none

    number = sympy.sympify(number)
    if number.is_Rational:
        return bool(number == 0)
    if abs(number.evalf(60, maxn=400)) > sympy.Float("1e-50"):
        return False
    return bool(sympy.simplify(number) == 0)


def sign(number: Any) -> int:
    """Return the sign -1, 0 or 1 of an exact sympy number."""
    if is_zero(number):
        return 0
    return 1 if number.evalf(60, maxn=400) > 0 else -1
