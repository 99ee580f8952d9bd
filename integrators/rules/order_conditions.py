"""Order conditions of compositions, and a user's own coefficients that are checked by them.

A step of size γh is exp(γhY₁ + (γh)^{q+1} Y_{q+1} + …), where q is the order of the base; for its
adjoint the even powers have the other sign, and a self-adjoint step has only odd ones. The
composition has order p if in Π exp(…) each word of the letters Y_k of weight ≤ p has the same
coefficient as in exp(hY₁); Lyndon words suffice, for the others follow from these (Murua,
Sanz-Serna, Phil. Trans. R. Soc. A 357 (1999), 1079; Hairer, Lubich, Wanner, III.3).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from math import factorial

import numpy as np

from ..errors import BadInput
from ..numbers import LazyModule, exact, sympy, working_digits
from ..numbers.types import Exact, Given, GivenVector, Mpf, Scalar, Scalars

mpmath = LazyModule("mpmath")
Word = tuple[int, ...]

MOST_ORDER = 10  # there are too many conditions of higher orders
#: error of a float: published ones have 15 decimals, and a formula's last units may be off
ROUNDED = Fraction(8, 2**53)
DECIMALS = 15  # a decimal with so many places counts as rounded, a shorter one as exact
_SUPER = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


@lru_cache(maxsize=64)
def lyndon_words(weight: int, over: int, odd: bool) -> tuple[Word, ...]:
    """Return the words of that weight that come before their own rotations, the shortest first.

    Their letters are 1 and k > over; odd: True for only odd letters among these.
    """
    letters = [k for k in range(1, weight + 1) if k == 1 or (k > over and (k % 2 or not odd))]

    def words(left: int) -> Iterator[Word]:
        if not left:
            yield ()
        for k in letters:
            if k <= left:
                yield from ((k, *rest) for rest in words(left - k))

    lyndon = (w for w in words(weight) if all(w < w[i:] + w[:i] for i in range(1, len(w))))
    return tuple(sorted(lyndon, key=len))


def conditions(order: int, over: int, odd: bool) -> list[Word]:
    """Return the words whose coefficients give a composition that order, lowest weights first."""
    return [w for weight in range(1, order + 1) for w in lyndon_words(weight, over, odd)]


def gap(word: Word, sizes: Scalars, in_turn: bool) -> Scalar:
    """Return the word's coefficient in the composition minus the required one.

    in_turn: True if the first, third, … of the sizes are steps of the adjoint.
    """
    coefficients = [1, *[0] * len(word)]  # coefficients of the word's beginnings
    for i, size in enumerate(sizes):
        powers = [size**k if k % 2 or not in_turn or i % 2 else -(size**k) for k in word]
        for j in range(len(word), 0, -1):
            term: Scalar = 1
            for first in range(j - 1, -1, -1):
                term *= powers[first]
                coefficients[j] += coefficients[first] * term / factorial(j - first)
    return coefficients[-1] - (1 if word == (1,) else 0)


def said(word: Word, in_turn: bool) -> str:
    """Return the condition as a formula in the coefficients γ, or in α and β of the adjoint."""
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
    """Coefficients that a user gave, as exact numbers; called with digits it returns mpf.

    rounded: the largest error of each. in_turn: True if they are steps of the adjoint and of the
    rule alternately. If they satisfy conditions as well as such numbers can, the nearby ones that
    satisfy them to all digits are taken: the least correction in the sum of squares, by Newton's
    method. Exact numbers stay unchanged.
    """

    numbers: tuple[Exact, ...]
    rounded: tuple[Fraction, ...]
    in_turn: bool = False
    over: int = 2  # the order of the composed steps

    def __call__(self, digits: int) -> list[Mpf]:
        return list(_held(self, max(digits, 64)))

    def given(self, digits: int) -> list[Mpf]:
        """Return the numbers as they were given."""
        with working_digits(digits + 10):
            return [_mpf(e, digits) for e in self.numbers]

    @cached_property
    def palindrome(self) -> bool:
        """True if they are a palindrome, as far as they are known."""
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
        """Return the violation of the condition; 0 if the rounding of the numbers explains it."""
        with working_digits(80):
            sizes = self.given(70)
            value = gap(word, sizes, self.in_turn)
            slopes = _slopes(word, tuple(map(float, sizes)), self.in_turn)
            allowed = sum(abs(s) * b for s, b in zip(slopes, self._bounds(), strict=True))
            return value if abs(value) > 2 * allowed + mpmath.mpf(10) ** -60 else mpmath.mpf(0)

    def first_missed(self, order: int, over: int | None = None) -> tuple[Word, Mpf] | None:
        """Return the first violated condition up to that order and its violation, or None.

        over: the order of the composed steps, if it is another.
        """
        return _first_missed(self, order, over or self.over)

    def order_over(self, over: int) -> int:
        """Return the order of the composition of steps of that order."""
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
        if own.palindrome:  # then corrections are palindromes too
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
            if own.palindrome:  # up to the round-off of the inverse
                sizes = _symmetric(sizes)
        return tuple(best)


def _symmetric(sizes: list[Mpf]) -> list[Mpf]:
    return [(a + b) / 2 for a, b in zip(sizes, sizes[::-1], strict=True)]


@lru_cache(maxsize=4096)
def _slopes(word: Word, sizes: tuple[float, ...], in_turn: bool) -> tuple[float, ...]:
    """Return the derivatives of `gap` by each size, by complex steps, without cancellation."""
    tiny, slopes = 1e-30, []
    for i in range(len(sizes)):
        moved: list[complex] = list(sizes)
        moved[i] = complex(sizes[i], tiny)
        slopes.append(complex(gap(word, moved, in_turn)).imag / tiny)
    return tuple(slopes)


def _mpf(value: Exact, digits: int) -> Mpf:
    if isinstance(value, Fraction):
        return mpmath.mpf(value.numerator) / value.denominator
    return mpmath.mpf(value._to_mpmath(mpmath.mp.prec + 20))


def read(values: GivenVector, what: str) -> tuple[list[Exact], list[Fraction]]:
    """Return exact numbers and the largest error of each; raises `BadInput` unless real."""
    if isinstance(values, str | bytes) or not hasattr(values, "__iter__"):
        raise BadInput(f"{what}: give a list of coefficients, such as [1/4, 1/2, 1/4].")
    numbers, rounded = list[Exact](), list[Fraction]()
    for i, value in enumerate(values):
        name = f"{what}: coefficient {i + 1}"
        complex_ = getattr(value, "is_real", None) is False or hasattr(value, "_mpc_")
        if isinstance(value, complex | np.complexfloating) or complex_:
            raise BadInput(
                f"{name} is {value}, a complex number: a step of complex size has no place in a "
                "real motion; give real coefficients."
            )
        numbers.append(exact(value, name))
        rounded.append(_rounded(value))
    if not numbers:
        raise BadInput(f"{what}: no coefficient is given.")
    return numbers, rounded


def check_sum(what: str, numbers: Sequence[Exact], rounded: Sequence[Fraction]) -> None:
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


def _rounded(value: Given) -> Fraction:
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
