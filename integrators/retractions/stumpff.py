"""The Stumpff functions c_k(z) = Σ (−z)ⁿ/(2n + k)!, entire and closed under differentiation.

c₀ = cos √z and c₁ = sin √z / √z (hyperbolic for z < 0); c_k = 1/k! − z c_{k+2} and
dc_k/dz = (k c_{k+2} − c_{k+1})/2 (Stumpff, Himmelsmechanik I, 1959, section 41; Danby,
Fundamentals of Celestial Mechanics, 6.9). Written with them nothing is 0/0 at the identity.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Any

from ..numbers import Arithmetic, InArithmetic, collect, entry, register, registered_function, sympy
from ..numbers.types import Expression, Letter, Number, Numbers


def stumpff(k: int, z: Expression) -> Expression:
    """c_k(z) as a sympy expression, k a whole number from 0."""
    return _class()(k, z)


@cache
def _class() -> Any:
    class Stumpff(InArithmetic, sympy.Function):
        """c_k(z), which knows its derivatives and its value at 0."""

        nargs = 2

        @classmethod
        def eval(cls, k: Expression, z: Expression) -> Expression | None:
            return sympy.Rational(1, sympy.factorial(k)) if z == 0 else None

        def _eval_derivative(self, s: Letter) -> Expression:
            k, z = self.args
            inner = z.diff(s)
            if inner == 0:
                return inner
            return (k * stumpff(k + 2, z) - stumpff(k + 1, z)) / 2 * inner

        def _eval_is_real(self) -> bool | None:
            return self.args[1].is_real

        def in_arithmetic(self, numbers: Arithmetic, values: Numbers) -> Number:
            """c_k of a number, by the text that the kernels have."""
            k = int(self.args[0])
            return registered_function(_registered(k | 3), numbers)(values[1])[k]

    Stumpff.__name__ = "stumpff"
    return Stumpff


def _registered(most: int) -> str:
    """The name of the function (c_0, …, c_most), which generated text may then call."""
    return register(f"stumpff_{most}", lambda: library(most))


@collect
def together(functions: Iterable[Expression]) -> dict[Expression, Expression]:
    """Return each c_k(z) as an entry of one call (c_0, …, c_K)(z), K = 3, 7, 11 …"""
    values = [e for e in functions if isinstance(e, _class())]
    if not values:
        return {}
    table = sympy.Function(_registered(max(int(c.args[0]) for c in values) | 3), real=True)
    return {c: entry(table(c.args[1]), c.args[0]) for c in values}


def library(most: int) -> str:
    """Text of stumpff_K(z) → (c_0, …, c_K), for double precision and for any other; K odd.

    |z| ≤ 1: the last two by Horner's rule, the others from c_k = 1/k! − z c_{k+2}. Beyond: from
    z/4ⁿ by c_j(4z) = 2⁻ʲ (c₀c_j + c₁c_{j−1} + Σ_{i=2}^j c_i/(j−i)!), which is
    φ_j(2s) = 2⁻ʲ (eˢφ_j(s) + Σ_i φ_i(s)/(j−i)!) with s² = −z and φ_j = c_j + s c_{j+1}: positive
    terms if z < 0. c₀ and c₁ are taken from sines each time, so that their errors do not double,
    and c₂(4z) = c₁²/2 keeps its zeros.
    """
    name, K = f"stumpff_{most}", most
    everything = ", ".join(f"c{k}" for k in range(K + 1))
    lower = "\n    ".join(f"c{k} = 1*OVER[{k}] - z*c{k + 2}" for k in range(K - 2, -1, -1))
    doubled = []
    for j in range(K, 2, -1):
        sums = "".join(f" + c{i}*OVER[{j - i}]" for i in range(2, j + 1))
        doubled.append(f"c{j} = (c0*c{j} + c1*c{j - 1}{sums})/{2**j}")
    doubling = "\n        ".join(doubled)
    return f"""
from math import factorial
TERMS_{K} = next(n for n in range(10**6) if 4*factorial({K - 1}) < EPS*factorial(2*n + {K + 1}))
OVER = tuple(R(1)/factorial(n) for n in range(2*TERMS_{K} + {K + 1}))

@aside
def {name}_near(z):
    c{K}, c{K - 1} = OVER[2*TERMS_{K} + {K}], OVER[2*TERMS_{K} + {K - 1}]
    for n in range(TERMS_{K} - 1, -1, -1):
        c{K} = OVER[2*n + {K}] - z*c{K}
        c{K - 1} = OVER[2*n + {K - 1}] - z*c{K - 1}
    {lower}
    return {everything}

@aside
def {name}_far(z):
    small, stages = z, 0
    while abs(small) > 1 and abs(small) < HUGE:
        small, stages = small/4, stages + 1
    {everything} = {name}_near(small)
    for _ in range(stages):
        {doubling}
        c2 = c1*c1/2
        small = 4*small
        s = sqrt(abs(small))
        if small > 0:
            c0, c1 = cos(s), sin(s)/s
        else:
            c0, c1 = cosh(s), sinh(s)/s
    return {everything}

@helper
def {name}(z):
    if abs(z) <= 1:
        return {name}_near(z)
    return {name}_far(z)
""".replace("1*OVER", "OVER")
