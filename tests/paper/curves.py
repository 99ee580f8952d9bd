"""Legendre maps, W and FL, from their definitions by curves in the groupoid and by formula."""

from __future__ import annotations

from typing import Any

from sympy import Matrix, Rational, eye

from .numbers import columns, mixed_slope, number, slope
from .sample import Sample, rank


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


def singular(s: Sample, g: Any = None) -> Sample:
    """The same sample with L_d bent so that det(FL − σ ℓ (Rᵀℓ)ᵀ) = 0 at g, of rank m − 1."""
    x, u = g or (s.x, s.u)
    ell = Matrix(s.m, 1, [Rational(2 + 3 * a, 5) for a in range(s.m)])
    sigma = 1 / (s.R(x, u).T * ell).dot(s.FL(x, u).LUsolve(ell))
    return s.changed(s.mutant, s.L_d_.bent(number(sigma), ell, u))


def rank_of_legendre(s: Sample, sign: str, g: Any = None) -> int:
    """The rank of the fibre part of T F^± at an arrow: m where F^± is a local diffeomorphism.

    F⁻ = (x, F⁻_γ) and F⁺ = (b(x, u), F⁺_γ) are maps to A*G, and n of their rank is the base's.
    """
    x, u = g or (s.x, s.u)

    def local(t: Any, way: Any) -> Any:
        at = x + t * way[: s.n, :], u + t * way[s.n :, :]
        if sign == "-":
            return at[0].col_join(s.minus(*at))
        return s.b(*at).col_join(s.plus(*at))

    ways = [eye(s.n + s.m)[:, k] for k in range(s.n + s.m)]
    return rank(Matrix.hstack(*[slope(lambda t, way=way: local(t, way)) for way in ways])) - s.n
