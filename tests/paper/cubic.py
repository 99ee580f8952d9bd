"""A discrete Lagrangian for the audit: a cubic polynomial in (x, u) with exact derivatives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

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
        z, q, a, k = self._with(x, u)
        total = q.dot(z) + (z.dot(z) + a.dot(z) ** 2) / 2 + k.dot(z) ** 3 / 6
        if self.kappa is not None:
            total += self.kappa.dot(u - self.v) * (u - self.u0).dot(u - self.u0)
        return total + (self.sigma * self.ell.dot(u - self.u1) ** 2 / 2 if self.sigma else 0)

    def gradient(self, x: Any, u: Any) -> Any:
        """(∂/∂x, ∂/∂u), (n+m)×1."""
        z, q, a, k = self._with(x, u)
        total = q + z + a * a.dot(z) + k * (k.dot(z) ** 2 / 2)
        more = zeros(self.m, 1)
        if self.kappa is not None:
            d = u - self.u0
            more += self.kappa * d.dot(d) + 2 * self.kappa.dot(u - self.v) * d
        if self.sigma:
            more += self.sigma * self.ell * self.ell.dot(u - self.u1)
        return total + zeros(self.n, 1).col_join(more)

    def hessian(self, x: Any, u: Any) -> Any:
        """(n+m)×(n+m)."""
        z, _, a, k = self._with(x, u)
        more = zeros(self.m)
        if self.kappa is not None:
            d = u - self.u0
            more += 2 * (self.kappa * d.T + d * self.kappa.T)
            more += 2 * self.kappa.dot(u - self.v) * eye(self.m)
        if self.sigma:
            more += self.sigma * self.ell * self.ell.T
        return eye(len(z)) + a * a.T + k * k.T * k.dot(z) + diag(zeros(self.n), more)

    def _with(self, x: Any, u: Any) -> tuple[Any, Any, Any, Any]:
        size = self.n + self.m
        return Matrix([*x, *u]), _vector(11, size), _vector(31, size), _vector(517, size)
