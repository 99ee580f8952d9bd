"""A number of a rule that is computed to as many digits as are asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

from ..errors import RAISED, BadInput, at_line, brief_name, check_function
from ..numbers import mpmath
from ..numbers.types import Mpf


@dataclass(frozen=True)
class Constant:
    """A number that `value(digits)` computes to any number of digits, each time the same.

    Raises `BadInput` where twice the digits show another number: runs in doubles would follow
    another rule than the steps that are judged with more digits; or where it gives no number,
    or is no function of digits.
    """

    value: Callable[[int], Mpf]

    def __post_init__(self) -> None:
        check_function(self.value, "a constant", "(digits)")

    def __call__(self, digits: int) -> Mpf:
        return _constant(self.value, digits)


@lru_cache(maxsize=1024)
def _constant(value: Callable[[int], Mpf], digits: int) -> Mpf:
    name = f"the constant {brief_name(value) if hasattr(value, '__name__') else 'of a rule'}"
    try:
        one, more = value(digits), value(2 * digits)
        with mpmath.workdps(2 * digits):
            off = abs(mpmath.mpf(one) - more) / max(1, abs(more))
    except BadInput:
        raise
    except RAISED as error:
        raise BadInput(
            f"{at_line(value, error)}{name} could not be computed to {digits} digits "
            f"({type(error).__name__}: {error}): return a number of mpmath."
        ) from error
    if off > mpmath.mpf(10) ** (3 - digits):  # a few of the last bit
        raise BadInput(
            f"{at_line(value)}{name} is off by {float(off):.2g} if {digits} digits are asked for: "
            "return the same number for all digits, computed within mpmath.workdps(digits)."
        )
    return one
