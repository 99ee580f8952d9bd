"""Legendre maps, W and FL, from their definitions by curves in the groupoid and by formula."""

from __future__ import annotations

from typing import Any

from sympy import Matrix, Rational

from .numbers import columns, mixed_slope, number, slope
from .sample import Sample


def plus_by_curve(s: Sample, g: Any, a: int) -> Any:
    """F⁺_γ(g): d/dt L_d(g c(t))."""
    return slope(lambda t: s.L_d(*s.pushed_left(g, a, t)))


def minus_by_curve(s: Sample, g: Any, a: int) -> Any:
    """F⁻_γ(g): −d/dt L_d(i(c(t)) g)."""
    return -slope(lambda t: s.L_d(*s.pushed_right(g, a, t)))


def W_by_curves(s: Sample, x: Any, u: Any) -> Any:
    """e←_μ(e→_γ(L_d)) in row γ, column μ: −∂²/∂t∂t′ L_d(i(c_γ(t)) g c_μ(t′))."""

    def moved(a: int, b: int) -> Any:
        def surface(t: Any, r: Any) -> Any:
            return s.L_d(*s.pushed_left(s.pushed_right((x, u), a, t), b, r))

        return -mixed_slope(surface)

    return Matrix(s.m, s.m, moved)


def FL_by_curves(s: Sample, x: Any, u: Any) -> Any:
    """−∂F⁻_μ/∂u^γ in row γ, column μ: ∂²/∂t∂r L_d(i(c_μ(t)) (x, u + r e_γ))."""

    def moved(c: int, a: int) -> Any:
        def surface(t: Any, r: Any) -> Any:
            return s.L_d(*s.pushed_right((x, u + r * s.e(c)), a, t))

        return mixed_slope(surface)

    return Matrix(s.m, s.m, moved)


def W_by_formula(s: Sample, g: Any) -> Any:
    """W_γμ = −L^θ_μ (FL)^θ_γ."""
    return -s.FL(*g).T * s.L(*g)


def left_of_minus(s: Sample) -> Any:
    """e←_μ(F⁻_γ) in row γ, column μ."""
    left = s.left(s.x, s.u)
    return columns(s.m, lambda a: s.along(s.minus, left[:, a]))


def right_of_plus(s: Sample) -> Any:
    """e→_γ(F⁺_μ) in row γ, column μ."""
    right = s.right(s.x, s.u)
    return columns(s.m, lambda a: s.along(s.plus, right[:, a])).T


def singular(s: Sample) -> Sample:
    """The same sample with L_d bent so that det(FL − σ ℓ (Rᵀℓ)ᵀ) = 0 at (x, u), of rank m − 1."""
    ell = Matrix(s.m, 1, [Rational(2 + 3 * a, 5) for a in range(s.m)])
    sigma = 1 / (s.R(s.x, s.u).T * ell).dot(s.FL(s.x, s.u).LUsolve(ell))
    return s.changed(s.mutant, s.L_d_.bent(number(sigma), ell, s.u))
