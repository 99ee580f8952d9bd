"""A discrete Lagrangian for the audit: a cubic polynomial in (x, u) with exact derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from gmpy2 import mpq
from sympy import Matrix, Rational, diag, eye, zeros


@lru_cache(maxsize=64)
def _vector(start: int, length: int) -> Any:
    """Fractions between −1 and 1 without any pattern, none of them 0."""
    return Matrix(
        length, 1, [Rational((7919 * (start + i)) % 1999 - 999, 1013) for i in range(length)]
    )


@dataclass(frozen=True)
class Cubic:
    """q·z + ½ z·z + ½ (a·z)² + (k·z)³/6 + κ·(u − v) |u − u₀|² + ½ σ (ℓ·(u − u₁))², z = (x, u).

    The term with κ has no derivative at u₀ and a chosen one at v; the last one changes the second
    derivative at u₁ only. With them a solution, or a singular FL, can be had exactly.
    """

    n: int
    m: int
    kappa: Any = None
    u0: Any = None
    v: Any = None
    sigma: Any = 0
    ell: Any = None
    u1: Any = None

    def solving(self, u0: Any, v: Any, wanted: Any) -> Cubic:
        """With ∂L_d/∂u increased by `wanted` at every (·, v), and unchanged at every (·, u₀)."""
        return replace(self, kappa=wanted / (v - u0).dot(v - u0), u0=u0, v=v)

    def bent(self, sigma: Any, ell: Any, u1: Any) -> Cubic:
        """With ∂²L_d/∂u∂u increased by σ ℓℓᵀ at every (·, u₁), and no first derivative there."""
        return replace(self, sigma=sigma, ell=ell, u1=u1)

    def value(self, x: Any, u: Any) -> Any:
        """A number, or an expression in symbols."""
        with_numbers = all(e.is_Rational for e in (*x, *u))
        z, q, a, k, kappa, u0, v, ell, u1 = self._scalars(x, u, with_numbers)
        w = z[self.n :]
        total = _dot(q, z) + (_dot(z, z) + _dot(a, z) ** 2) / 2 + _dot(k, z) ** 3 / 6
        if kappa:
            d = _minus(w, u0)
            total += _dot(kappa, _minus(w, v)) * _dot(d, d)
        if ell:
            total += _plain(self.sigma, with_numbers) * _dot(ell, _minus(w, u1)) ** 2 / 2
        return _sympy(total)

    def gradient(self, x: Any, u: Any) -> Any:
        """(∂/∂x, ∂/∂u) at numbers, (n+m)×1."""
        z, q, a, k, kappa, u0, v, ell, u1 = self._scalars(x, u, True)
        w, along_a, along_k = z[self.n :], _dot(a, z), _dot(k, z) ** 2 / 2
        total = [q[i] + z[i] + a[i] * along_a + k[i] * along_k for i in range(len(z))]
        for i in range(self.m):
            if kappa:
                d = _minus(w, u0)
                more = kappa[i] * _dot(d, d) + 2 * _dot(kappa, _minus(w, v)) * d[i]
                total[self.n + i] += more
            if ell:
                more = _plain(self.sigma, True) * ell[i] * _dot(ell, _minus(w, u1))
                total[self.n + i] += more
        return Matrix(len(z), 1, [_sympy(e) for e in total])

    def hessian(self, x: Any, u: Any) -> Any:
        """(n+m)×(n+m), at numbers."""
        size = self.n + self.m
        a, k, z = _vector(31, size), _vector(517, size), Matrix([*x, *u])
        more = zeros(self.m)
        if self.kappa is not None:
            d = u - self.u0
            more += 2 * (self.kappa * d.T + d * self.kappa.T)
            more += 2 * self.kappa.dot(u - self.v) * eye(self.m)
        if self.sigma:
            more += self.sigma * self.ell * self.ell.T
        return eye(size) + a * a.T + k * k.T * k.dot(z) + diag(zeros(self.n), more)

    def _scalars(self, x: Any, u: Any, with_numbers: bool) -> list[list[Any]]:
        """z, q, a, k, κ, u₀, v, ℓ, u₁ as lists, of gmpy2's fast rationals or of symbols."""
        size = self.n + self.m
        columns = [[*x, *u], _vector(11, size), _vector(31, size), _vector(517, size)]
        columns += [self.kappa, self.u0, self.v, self.ell, self.u1]
        return [[_plain(e, with_numbers) for e in column or ()] for column in columns]


def _plain(e: Any, as_number: bool) -> Any:
    return mpq(int(e.p), int(e.q)) if as_number else e


def _sympy(e: Any) -> Any:
    return Rational(int(e.numerator), int(e.denominator)) if isinstance(e, type(mpq())) else e


def _dot(a: list[Any], b: list[Any]) -> Any:
    return sum(p * q for p, q in zip(a, b, strict=True))


def _minus(a: list[Any], b: list[Any]) -> list[Any]:
    return [p - q for p, q in zip(a, b, strict=True)]
