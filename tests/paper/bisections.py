"""Local bisections of a sample's groupoid, with sections that need no equation solved.

Σ is given by its section of β, Σ_β(x) = i(x, s(x)); Υ by its section of α, Υ_α(x) = (x, υ(x));
s and υ are affine, so that L_Σ and R_Υ are explicit. They pass through the sample's g and h.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

from sympy import Matrix, Rational

from .sample import Sample

Arrow = tuple[Any, Any]


class Translations:
    """L_Σ and R_Υ of a sample, and L_d composed with them."""

    def __init__(self, s: Sample) -> None:
        self.s = s
        small = Rational(1, 7) / s.h
        self.slope = Matrix(
            s.m, s.n, lambda i, j: small * Rational((5 * i + 3 * j) % 7 - 3, 100) + small / 300
        )

    @cached_property
    def g_W(self) -> Arrow:
        """An arrow near the identities at β(g), in general position."""
        s = self.s
        return s.y + Matrix(s.n, 1, [Rational(1 + k, 90) for k in range(s.n)]), s.w

    @cached_property
    def h_W(self) -> Arrow:
        """One that can follow it."""
        return self.s.b(*self.g_W), self.s.v

    def sigma_beta(self, x: Any) -> Arrow:
        """The arrow of Σ that ends at x; g for x = β(g)."""
        s = self.s
        return s.inverse((x, s.iota(s.x, s.u) + self.slope * (x - s.y)))

    def upsilon_alpha(self, x: Any) -> Arrow:
        """The arrow of Υ that starts at x; h for x = α(h)."""
        return x, self.s.v + self.slope * (x - self.s.y)

    def left(self, g: Arrow) -> Arrow:
        """L_Σ(g) = Σ_β(α(g)) g."""
        return self.s.times(self.sigma_beta(g[0]), g)

    def right(self, g: Arrow) -> Arrow:
        """R_Υ(g) = g Υ_α(β(g))."""
        return self.s.times(g, self.upsilon_alpha(self.s.b(*g)))

    def of_left(self, x: Any, u: Any) -> Any:
        """L_d∘L_Σ, a number."""
        return self.s.L_d(*self.left((x, u)))

    def of_right(self, x: Any, u: Any) -> Any:
        """L_d∘R_Υ, a number."""
        return self.s.L_d(*self.right((x, u)))

    def of_left_barred(self, x: Any, u: Any) -> Any:
        """L_d∘L_Σ as a function of the coordinates (x̄, ū) = (x, u)∘i."""
        return self.of_left(*self.s.inverse((x, u)))

    def of_right_barred(self, x: Any, u: Any) -> Any:
        """L_d∘R_Υ as a function of the coordinates (x̄, ū) = (x, u)∘i."""
        return self.of_right(*self.s.inverse((x, u)))
