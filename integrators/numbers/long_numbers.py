"""Numbers of too many digits are refused before anything computes them.

A few letters are enough for a number that fills the memory: 10**(10**7), or the factorial of 10⁷.
Sympy computes one as soon as it stands in a sum or a product, and would never end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

from ..errors import BadInput
from .lazy import sympy
from .types import Expression

#: bits of a numerator or denominator: Python writes no integer of more than 4,300 digits
LARGEST = 14_000
#: bits of what a user's function may meet on its way: computed within a tenth of a second
LONGEST = 2**20
FLOAT_BITS = 1000  # of a whole number that is a double for certain
#: modules of sympy with functions of whole numbers that are computed exactly
_EXACT = ("sympy.functions.combinatorial", "sympy.functions.special")
_COUNTING = ("factorial", "factorial2", "subfactorial", "binomial", "RisingFactorial",
             "FallingFactorial", "fibonacci", "lucas", "tribonacci", "harmonic", "bernoulli",
             "euler", "genocchi", "catalan", "bell", "gamma", "zeta", "polygamma")  # fmt: skip


def refuse_long(integers: Iterable[int], what: str) -> None:
    """Raise `BadInput` if one of the integers is longer than Python writes them."""
    _refuse(max((n.bit_length() for n in integers), default=0), what)


def refuse_unwritten(expression: Expression, what: str) -> None:
    """Raise `BadInput` for a number in it that is, or would be if it were computed, too long."""
    _refuse(_bits(expression, {})[0], what)


def _refuse(bits: float, what: str, most: int = LARGEST) -> None:
    if bits > most:
        many = f"about {int(bits) * 3 // 10}" if bits < 2**50 else "more than 10¹⁵"
        raise BadInput(f"{what} has a number of {many} digits: choose units that fit the motion.")


def _bits(part: Expression, known: dict[Expression, tuple[float, bool]]) -> tuple[float, bool]:
    """(a bound of the bits of the exact numbers within it, whether it is a number itself).

    A sum or a product counts as its longest part. What is above `LARGEST` is no bound any more.
    """
    if part in known:
        return known[part]
    inner = [_bits(argument, known) for argument in part.args]
    bits = longest = max((b for b, _ in inner), default=0)
    constant = not (part.is_Symbol or any(not told for _, told in inner))
    if part.is_Rational:
        bits = _bits_of(part)
    elif part.is_Float:
        bits = int(part._mpf_[1]).bit_length() + abs(part._mpf_[2])
    elif constant and longest <= LARGEST and inner:
        sizes = [_size(a, b) for a, (b, _) in zip(part.args, inner, strict=True)]
        if part.is_Pow and inner[0][0] > 1:  # its base is at least 2
            bits = max(longest, inner[0][0] * sizes[1])
        elif type(part).__name__ in ("exp", "sinh", "cosh"):
            bits = max(longest, 2 * sizes[0])
        elif type(part).__module__.startswith(_EXACT):
            bits = max(longest, max(sizes) * longest)  # of n! about n log₂ n
    known[part] = bits, constant
    return known[part]


def _bits_of(number: Expression) -> int:
    return max(int(number.p).bit_length(), int(number.q).bit_length())


def _size(number: Expression, bits: float) -> float:
    """A bound of its absolute value."""
    if bits > FLOAT_BITS:
        return math.inf
    return abs(int(number.p) / int(number.q)) if number.is_Rational else 2.0**bits


# -- while a function of the user's is evaluated ---------------------------------------------------

_lock, _watching = Lock(), [0]
_before = list[tuple[Any, str, Any]]()  # class, name, and what was there


@contextmanager
def short_numbers(what: str) -> Iterator[None]:
    """Raise `BadInput` where the block lets sympy compute a number of more than `LONGEST` bits.

    Powers of numbers, factorials and their like are looked at before they are computed, by all
    threads while one of them is in such a block. What Python computes by itself is not seen.
    """
    with _lock:
        _watching[0] += 1
        if _watching[0] == 1:
            _watch(what)
    try:
        yield
    finally:
        with _lock:
            _watching[0] -= 1
            while _before and not _watching[0]:
                kind, name, own = _before.pop()
                setattr(kind, name, own)


def _watch(what: str) -> None:
    for kind in (sympy.Integer, sympy.Rational):
        _before.append((kind, "_eval_power", kind.__dict__["_eval_power"]))
        kind._eval_power = _power(kind._eval_power, what)
    for kind in (getattr(sympy, name) for name in _COUNTING):
        _before.append((kind, "eval", kind.__dict__["eval"]))
        kind.eval = classmethod(_counting(kind.__dict__["eval"].__func__, what))


def _power(function: Callable[..., Any], what: str) -> Callable[..., Any]:
    def power(base: Any, exponent: Any) -> Any:
        if exponent.is_Rational and (bits := _bits_of(base)) > 1:
            _refuse(bits * _size(exponent, _bits_of(exponent)), what, LONGEST)
        return function(base, exponent)

    return power


def _counting(function: Callable[..., Any], what: str) -> Callable[..., Any]:
    def counting(kind: Any, *given: Any) -> Any:
        for number in given:
            if getattr(number, "is_Rational", False):
                bits = _bits_of(number)
                _refuse(_size(number, bits) * bits, what, LONGEST)
        return function(kind, *given)

    return counting
