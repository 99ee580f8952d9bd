"""Order conditions of compositions, and coefficients of one's own that are held to them.

A step of size γh is exp(γhY₁ + (γh)^{q+1} Y_{q+1} + …), q the order of the base; of its adjoint the
even powers have the other sign, and a self-adjoint step has odd ones alone. The composition is of
order p if in Π exp(…) each word of the letters Y_k of weight ≤ p has the coefficient that it has in
exp(hY₁); Lyndon words are enough, for the others follow from these (Murua, Sanz-Serna, Phil. Trans.
R. Soc. A 357 (1999), 1079; Hairer, Lubich, Wanner, III.3).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from math import factorial
from typing import Any

import numpy as np

from ..errors import BadInput
from ..numbers import LazyModule, exact, sympy, working_digits
from ..numbers.types import Mpf

mpmath: Any = LazyModule("mpmath")
Word = tuple[int, ...]

MOST_ORDER = 10  # conditions of higher orders are too many to be asked
#: of a float: published ones have 15 decimals, and a formula's are off by some units in the last
ROUNDED = Fraction(8, 2**53)
DECIMALS = 15  # a decimal of so many places is taken for rounded, a shorter one for exact
_SUPER = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


@lru_cache(maxsize=64)
def lyndon_words(weight: int, over: int, odd: bool) -> tuple[Word, ...]:
    """Words of that weight that come before their own rotations, the shortest first.

    Their letters are 1 and k > over; odd: of these the odd ones alone.
    """
    letters = [k for k in range(1, weight + 1) if k == 1 or (k > over and (k % 2 or not odd))]

    def words(left: int) -> Iterator[Word]:
        if not left:
            yield ()
        for k in letters:
            if k <= left:
                yield from ((k, *rest) for rest in words(left - k))

    found = (w for w in words(weight) if all(w < w[i:] + w[:i] for i in range(1, len(w))))
    return tuple(sorted(found, key=len))


def conditions(order: int, over: int, odd: bool) -> list[Word]:
    """The words whose coefficients make a composition of that order, lowest weights first."""
    return [w for weight in range(1, order + 1) for w in lyndon_words(weight, over, odd)]


def gap(word: Word, sizes: Sequence[Any], in_turn: bool) -> Any:
    """The word's coefficient in the composition less the wanted one.

    in_turn: the first, third, … of the sizes are steps of the adjoint.
    """
    found = [1, *[0] * len(word)]  # of what the word begins with
    for i, size in enumerate(sizes):
        powers = [size**k if k % 2 or not in_turn or i % 2 else -(size**k) for k in word]
        for j in range(len(word), 0, -1):
            term: Any = 1
            for first in range(j - 1, -1, -1):
                term *= powers[first]
                found[j] += found[first] * term / factorial(j - first)
    return found[-1] - (1 if word == (1,) else 0)


def said(word: Word, in_turn: bool) -> str:
    """The condition as a formula, of the coefficients γ, or of α and those of the adjoint, β."""
    if word == (1,):
        return "Σ (αᵢ + βᵢ) = 1" if in_turn else "Σ γᵢ = 1"
    power = ["" if k == 1 else str(k).translate(_SUPER) for k in word]
    if len(word) == 1:
        sign = "+" if word[0] % 2 else "−"
        return f"Σ (αᵢ{power[0]} {sign} βᵢ{power[0]}) = 0" if in_turn else f"Σ γᵢ{power[0]} = 0"
    indices = "ijklmnopqr"[: len(word)]
    letters = "ᵢⱼₖₗₘₙₒₚqᵣ"
    product = " ".join(f"γ{letter}{p}" for letter, p in zip(letters, power, strict=False))
    of = ", with −β^k in place of γ^k for steps of the adjoint and even k" if in_turn else ""
    return f"Σ {product} = 0 over {' ≤ '.join(indices)} (k equal indices count 1/k!{of})"


@dataclass(frozen=True)
class OwnNumbers:
    """Coefficients that a user gave, as exact numbers; called with digits: as mpf.

    rounded: by how much each may be off. in_turn: they are steps of the adjoint and of the rule by
    turns. Where they meet conditions as well as such numbers can, the nearby ones
    that meet them to all digits are taken: the least correction in the sum of squares, by Newton's
    method. Exact numbers stay as they are.
    """

    numbers: tuple[Any, ...]
    rounded: tuple[Fraction, ...]
    in_turn: bool = False
    over: int = 2  # the order of the steps that are composed

    def __call__(self, digits: int) -> list[Mpf]:
        return list(_held(self, max(digits, 64)))

    def given(self, digits: int) -> list[Mpf]:
        """As they were given."""
        with working_digits(digits + 10):
            return [_mpf(e, digits) for e in self.numbers]

    @cached_property
    def palindrome(self) -> bool:
        """Whether they are the same from behind, as far as they are known."""
        return all(
            abs(a - b) <= d + e + mpmath.mpf(10) ** -60
            for a, b, d, e in zip(
                self.given(70), self.given(70)[::-1], self._bounds(), self._bounds()[::-1],
                strict=True,
            )
        )  # fmt: skip

    def _bounds(self) -> list[Mpf]:
        return [mpmath.mpf(e.numerator) / e.denominator for e in self.rounded]

    def missed(self, word: Word) -> Mpf:
        """By how much the condition is missed; 0 where what was rounded accounts for it."""
        with working_digits(80):
            sizes = self.given(70)
            value = gap(word, sizes, self.in_turn)
            slopes = _slopes(word, tuple(map(float, sizes)), self.in_turn)
            allowed = sum(abs(s) * b for s, b in zip(slopes, self._bounds(), strict=True))
            return value if abs(value) > 2 * allowed + mpmath.mpf(10) ** -60 else mpmath.mpf(0)

    def first_missed(self, order: int, over: int | None = None) -> tuple[Word, Mpf] | None:
        """The first condition up to that order that does not hold, and by how much; None: all do.

        over: the order of the steps that are composed, if it is another.
        """
        return _first_missed(self, order, over or self.over)

    def order_over(self, over: int) -> int:
        """The order of the composition of steps of that order."""
        missed = self.first_missed(MOST_ORDER, over)
        return MOST_ORDER if missed is None else sum(missed[0]) - 1


@lru_cache(maxsize=256)
def _first_missed(own: OwnNumbers, order: int, over: int) -> tuple[Word, Mpf] | None:
    for word in conditions(order, over, not own.in_turn):
        if missed := own.missed(word):
            return word, missed
    return None


@lru_cache(maxsize=64)
def _held(own: OwnNumbers, digits: int) -> tuple[Mpf, ...]:
    sizes = own.given(digits)
    loose = [i for i, e in enumerate(own.rounded) if e]
    if not loose:
        return tuple(sizes)
    every = conditions(own.order_over(own.over), own.over, not own.in_turn)
    words = [w for w in every if sum(w) % 2 or not own.palindrome]
    with working_digits(digits + 10):
        if own.palindrome:
            sizes = _symmetric(sizes)
        start = tuple(map(float, sizes))
        slopes = np.array([_slopes(w, start, own.in_turn) for w in words])
        if own.palindrome:  # corrections are palindromes too
            slopes = (slopes + slopes[:, ::-1]) / 2
        inverse = np.linalg.pinv(slopes[:, loose], rcond=1e-10)
        worst, best = None, sizes
        for _ in range(40):
            gaps = [gap(w, sizes, own.in_turn) for w in words]
            size = max(map(abs, gaps))
            if worst is not None and size >= worst:
                break
            worst, best, sizes = size, sizes, list(sizes)
            for row, i in zip(inverse, loose, strict=True):
                sizes[i] -= sum(mpmath.mpf(float(e)) * g for e, g in zip(row, gaps, strict=True))
            if own.palindrome:  # but for the round-off of the inverse
                sizes = _symmetric(sizes)
        return tuple(best)


def _symmetric(sizes: list[Mpf]) -> list[Mpf]:
    return [(a + b) / 2 for a, b in zip(sizes, sizes[::-1], strict=True)]


@lru_cache(maxsize=4096)
def _slopes(word: Word, sizes: tuple[float, ...], in_turn: bool) -> tuple[float, ...]:
    """The derivatives of `gap` by each of the sizes, by complex steps, which round nothing off."""
    tiny, found = 1e-30, []
    for i in range(len(sizes)):
        moved: list[complex] = list(sizes)
        moved[i] = complex(sizes[i], tiny)
        found.append(complex(gap(word, moved, in_turn)).imag / tiny)
    return tuple(found)


def _mpf(value: Any, digits: int) -> Mpf:
    if isinstance(value, Fraction):
        return mpmath.mpf(value.numerator) / value.denominator
    return mpmath.mpf(value._to_mpmath(mpmath.mp.prec + 20))


def read(values: Any, what: str) -> tuple[list[Any], list[Fraction]]:
    """Exact numbers and by how much each may be off; raises `BadInput` for what is no real one."""
    if isinstance(values, str | bytes) or not hasattr(values, "__iter__"):
        raise BadInput(f"{what}: give a list of coefficients, such as [1/4, 1/2, 1/4].")
    found, rounded = list[Any](), list[Fraction]()
    for i, value in enumerate(values):
        name = f"{what}: coefficient {i + 1}"
        complex_ = getattr(value, "is_real", None) is False or hasattr(value, "_mpc_")
        if isinstance(value, complex | np.complexfloating) or complex_:
            raise BadInput(
                f"{name} is {value}, a complex number: a step of complex size has no place in a "
                "real motion; give real coefficients."
            )
        found.append(exact(value, name))
        rounded.append(_rounded(value))
    if not found:
        raise BadInput(f"{what}: no coefficient is given.")
    return found, rounded


def check_sum(what: str, numbers: Sequence[Any], rounded: Sequence[Fraction]) -> None:
    """Raise `BadInput` unless the numbers add up to 1, as far as they are known."""
    total = sum(numbers, Fraction(0))
    missing = total - 1
    if abs(missing) > sum(rounded, Fraction(0)) and sympy.sympify(missing).is_zero is not True:
        exactly = isinstance(missing, Fraction)
        if not exactly and abs(sympy.N(missing, 60)) < 1e-50:
            return
        side = "more" if missing > 0 else "less"
        raise BadInput(
            f"{what} the coefficients add up to {float(total):.15g}, which is "
            f"{float(abs(missing)):.6g} {side} than 1: the substeps would not make a whole step."
        )


def _rounded(value: Any) -> Fraction:
    if isinstance(value, str):
        decimals = re.fullmatch(r"\s*[+-]?\d*\.(\d+)\s*", value)
        places = len(decimals[1]) if decimals else 0
        return Fraction(1, 10**places) if places >= DECIMALS else Fraction(0)
    if hasattr(value, "_mpf_") and not hasattr(value, "as_mantissa_exp"):
        return Fraction(8, 2**mpmath.mp.prec)
    if isinstance(value, np.floating) and value.dtype.itemsize < 8:
        return Fraction(8, 2**24)
    is_float = isinstance(value, float) or getattr(value, "is_Float", False)
    return ROUNDED if is_float else Fraction(0)
