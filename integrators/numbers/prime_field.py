"""The integers modulo a prime p as a kind of number: rational formulas without any rounding.

A sum of products of fractions that is 0 is 0 here too, and one that is not is 0 for few p alone.
Only 0 has a sign, a logarithm and a cosine; a root is taken where there is one. For p ≡ 11 mod 12
the squares are a group of odd order, in which each has one square root, and every element has one
cube root: these roots obey √a √b = √(ab), as those of real numbers do.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from fractions import Fraction
from typing import Any

import numpy as np

from .arithmetic import FUNCTIONS
from .lazy import LazyModule
from .types import Function, Matrix, Namespace, Number

flint: Any = LazyModule("flint")

BITS = 62  # of a prime; flint computes with polynomials over these in machine words
TERMS = 40  # of the series of a function of a matrix: one of the size h vanishes before


class NotRational(ArithmeticError):
    """A formula asks for a function that takes an element of the field to none, or for a sign."""


class Residue:
    """An element v of F_p; it computes with integers and fractions, and is never rounded."""

    __slots__ = ("v",)
    v: int
    __array_ufunc__ = None
    __hash__ = None  # type: ignore[assignment]
    p: int = 2

    def __init__(self, value: Number) -> None:
        if isinstance(value, Residue):
            value = value.v
        elif type(value) is not int:
            if isinstance(value, float):
                raise NotRational(f"a rounded number, {value}, was computed on the way")
            top, bottom = int(value.numerator), int(value.denominator)
            value = top * pow(bottom, -1, self.p)
        self.v = value % self.p

    def _read(self, other: Any) -> int | None:
        """Return an integer that stands for a number; None for what is none, such as a series."""
        if isinstance(other, Residue):
            return other.v
        if type(other) is int:
            return other
        if hasattr(other, "coefficient") or isinstance(other, np.ndarray):
            return None
        return int(type(self)(other).v)

    def _made(self, value: int) -> Residue:
        made: Residue = object.__new__(type(self))
        made.v = value % self.p
        return made

    def __add__(self, other: Any) -> Any:
        e = self._read(other)
        return NotImplemented if e is None else self._made(self.v + e)

    def __sub__(self, other: Any) -> Any:
        e = self._read(other)
        return NotImplemented if e is None else self._made(self.v - e)

    def __rsub__(self, other: Any) -> Any:
        return -self + other

    def __mul__(self, other: Any) -> Any:
        e = self._read(other)
        return NotImplemented if e is None else self._made(self.v * e)

    def __truediv__(self, other: Any) -> Any:
        e = self._read(other)
        return NotImplemented if e is None else self * self._made(e).inverse()

    def __rtruediv__(self, other: Any) -> Any:
        return self.inverse() * other

    def __pow__(self, power: int) -> Residue:
        return self._made(pow((self if power >= 0 else self.inverse()).v, abs(power), self.p))

    def inverse(self) -> Residue:
        """Return 1/self; raises `ZeroDivisionError` for 0."""
        if not self.v:
            raise ZeroDivisionError("division by 0 in F_p")
        return self._made(pow(self.v, -1, self.p))

    def __neg__(self) -> Residue:
        return self._made(-self.v)

    def __pos__(self) -> Residue:
        return self

    def __abs__(self) -> Residue:
        self._sign()
        return self

    def __eq__(self, other: object) -> bool:
        e = self._read(other)
        return e is not None and (self.v - e) % self.p == 0

    def __int__(self) -> int:
        return self.v

    def __repr__(self) -> str:
        return f"{self.v} mod {self.p}"

    def _sign(self) -> int:
        if self.v:
            raise NotRational("a formula asks for the sign or the size of a number")
        return 0

    def __lt__(self, other: Any) -> bool:
        return bool(self._sign() < other)

    def __gt__(self, other: Any) -> bool:
        return bool(self._sign() > other)

    def __le__(self, other: Any) -> bool:
        return bool(self._sign() <= other)

    def __ge__(self, other: Any) -> bool:
        return bool(self._sign() >= other)

    __radd__, __rmul__ = __add__, __mul__


class PrimeField:
    """F_p as an arithmetic. p: a prime ≡ 11 mod 12."""

    dtype = object
    eps = 0

    def __init__(self, p: int) -> None:
        self.p = p
        self.number: Callable[..., Residue] = type("Residue", (Residue,), {"__slots__": (), "p": p})

    @classmethod
    def at_random(cls, draw: random.Random) -> PrimeField:
        """Return the field of a random prime p ≡ 11 mod 12 of `BITS` bits."""
        while True:
            p = 12 * draw.randrange(2 ** (BITS - 1) // 12, 2**BITS // 12) + 11
            if flint.fmpz(p).is_prime():
                return cls(p)

    def working(self) -> nullcontext[None]:
        """Return the context for computing in this arithmetic: none."""
        return nullcontext()

    def random(self, count: int, draw: random.Random) -> list[Residue]:
        """Return elements drawn alike."""
        return [self.number(draw.randrange(self.p)) for _ in range(count)]

    def root(self, e: Number, degree: int) -> Residue:
        """Return the root that is a square itself if the degree is even, or else the only one.

        Raises `NotRational` where there is none, or several.
        """
        e, order = self.number(e), self.p - 1
        while degree % 2 == 0:
            if e.v and pow(e.v, order // 2, self.p) != 1:
                raise NotRational("a root is not in the field")
            e, degree = e ** ((self.p + 1) // 4), degree // 2
        try:
            return e ** pow(degree, -1, order)
        except ValueError:
            raise NotRational(f"there is no one root of the degree {degree}") from None

    def namespace(self) -> Namespace:
        """Return the names that generated text needs; functions are known at 0, roots beside."""

        def known(name: str) -> Function:
            def function(e: Number, *_: Number) -> Residue:
                if self.number(e).v or name in ("log", "acos", "atan2"):
                    raise NotRational(f"{name} is no rational function")
                return self.number(int(name in ("cos", "cosh", "exp")))

            return function

        functions = {name: known(name) for name in {*FUNCTIONS.values()} - {"abs"}}
        return {**functions, "sqrt": lambda e: self.root(e, 2), "R": self.number,
                "PI": _Unknown("π"), "constant": _Unknown, "zeros": self.zeros,
                "EPS": Fraction(1, 2**100), "matrix_function": self._matrix_function}  # fmt: skip

    array_namespace = namespace

    def zeros(self, *shape: int) -> np.ndarray:
        """Return an array of zeros."""
        return np.full(shape, self.number(0), dtype=object)

    def _matrix_function(
        self, out: Matrix, a: Matrix, phi: Matrix, other: Matrix, size: int, kind: int
    ) -> None:
        """Write f(a), a of size h, into out: (e^a − 1)/a (kind 0), its inverse (1), e^a − 1 (2).

        The text of that name (`retractions.matrix_functions`) scales by a norm, which is not here.
        """
        one = self.zeros(size, size) + np.eye(size, dtype=int)

        def series(e: Matrix, share: Callable[[int], Number]) -> Matrix:
            """Return Σ e^k Π share, up to powers that vanish as far as e is known."""
            total, power = 0 * one, one
            end = max((c.end for c in e.flat if hasattr(c, "end")), default=0)
            for k in range(TERMS):
                total, power = total + power, power @ e * share(k)
                if not any(_seen(c, end) for c in power.flat):
                    return total
            raise NotRational("the exponential of a matrix is no rational function")

        phi_1 = series(a, lambda k: Fraction(1, k + 2))
        if kind == 1:
            phi_1 = series(one - phi_1, lambda k: 1)
        out[...] = a @ phi_1 if kind == 2 else phi_1

    def polynomial(self, coefficients: list[Any]) -> Any:
        """Return flint's polynomial over the field, from the lowest power."""
        return flint.nmod_poly([self.number(e).v for e in coefficients], self.p)

    def roots(self, polynomial: Any) -> list[Residue] | None:
        """Return its roots if they are all in the field and differ; else None."""
        roots = [self.number(int(r)) for r, _ in polynomial.roots()]
        return roots if len(roots) == polynomial.degree() else None


def small_fraction(images: Sequence[Residue]) -> Fraction | None:
    """Return the fraction of small numbers that has these images in different fields, or None.

    Numerator and denominator have a third of the bits of the product P of the primes: random
    elements are those of one with a chance of about P^(−1/3).
    """
    value, modulus = 0, 1
    for e in images:
        value += modulus * ((e.v - value) * pow(modulus, -1, e.p) % e.p)
        modulus *= e.p
    most = 1 << modulus.bit_length() // 3
    a, b, u, w = modulus, value, 0, 1
    while b >= most:
        q = a // b
        a, b, u, w = b, a - q * b, w, u - q * w
    return Fraction(b, w) if 0 < abs(w) < most else None


def _seen(e: Any, end: int) -> bool:
    """Return whether a series has a coefficient below the power `end`, or a number is not 0."""
    return any(c != 0 for c in e.c[: max(0, end - e.start)]) if hasattr(e, "end") else e != 0


class _Unknown:
    """A number that is in no field; whatever computes with it is refused."""

    __array_ufunc__ = None

    def __init__(self, name: str) -> None:
        self.name = name

    def _refuse(self, *_: Any) -> Any:
        raise NotRational(f"{self.name} is no algebraic number")

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = _refuse
    __truediv__ = __rtruediv__ = __pow__ = __neg__ = _refuse
