"""Section 3.6.2: Lie groups, retractions, the Cayley transform."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sympy import Matrix, eye

from .curves import minus_by_curve, plus_by_curve
from .numbers import columns, numbers, slope
from .rows import CAYLEY, MATRIX, Claim, checked, definition, printed, same
from .sample import Sample

definition("3.6.2-1", r"a group as a groupoid over one point")


@checked("3.6.2-text", r"$\tau(\xi)\tau(-\xi)=e$; the product is that of the group", how=MATRIX)
def retraction(s: Sample) -> Iterator[Claim]:
    g, h = s.tau(s.h * s.u), s.tau(s.h * s.v)
    yield same("τ(ξ)τ(−ξ)", g * s.tau(-s.h * s.u), eye(g.rows))
    yield same("τ(hu)τ(hv)", g * h, s.tau(s.h * s.p(s.x, s.u, s.v)))


@checked(
    "3.6.2-2",
    r"$T_\xi\tau(\eta)=d\tau_\xi(\eta) \tau(\xi)$, and $d\tau^{-1}_{hu}=R$",
    "dtau-step",
    how=MATRIX,
)
def trivialised_tangent(s: Sample) -> Iterator[Claim]:
    xi = s.h * s.u
    dtau = numbers(s.R(s.x, s.u).inv())
    for a in range(s.m):
        found = slope(lambda t, a=a: s.tau(xi + t * s.e(a)))
        yield same("τ(ξ)", found, hat(s, dtau[:, a]) * s.tau(xi))  # [misprint: dtau-step]
        yield printed("dtau-step", found, hat(s, dtau[:, a]) * s.tau(s.h * xi))


@checked(
    "3.6.2-3",
    r"$\overleftarrow{e_\gamma}(\eta)=d\tau^{-1}_{h\eta}(Ad_{\tau(h\eta)}e_\gamma)$,"
    r" $\overrightarrow{e_\gamma}(\eta)=d\tau^{-1}_{h\eta}(e_\gamma)$ for"
    r" $e_\gamma=\partial_{u^\gamma}$, $h$ times the basis",
    "fields-step",
    how=MATRIX,
)
def fields(s: Sample) -> Iterator[Claim]:
    # e_γ is ∂/∂u^γ at the identity, h times the basis element [misprint: fields-step]
    g, R, Ad = s.tau(s.h * s.u), s.R(s.x, s.u), adjoint(s, s.u)
    L = R * Ad
    yield same("left", s.L(s.x, s.u), L)
    for a in range(s.m):
        moved = slope(lambda t, a=a: s.tau(s.h * (s.u + t * L[:, a])))
        yield same("τ(hη) e_γ", moved, g * hat(s, s.h * s.e(a)))
        yield printed("fields-step", moved, g * hat(s, s.e(a)))
        moved = slope(lambda t, a=a: s.tau(s.h * (s.u + t * R[:, a])))
        yield same("e_γ τ(hη)", moved, hat(s, s.h * s.e(a)) * g)


@checked(
    "3.6.2-4",
    r"$\overleftarrow{e_\gamma}(\eta_k)(l)-\overrightarrow{e_\gamma}(\eta_{k+1})(l)=0$",
    "l-for-L_d",
    how=MATRIX,
)
def euler_poincare(s: Sample) -> Iterator[Claim]:
    if not s.n:
        g, h = (s.x, s.u), (s.x, s.w)
        wanted = [plus_by_curve(s, g, a) - minus_by_curve(s, h, a) for a in range(s.m)]
        yield same("left − right", left(s, s.u) - right(s, s.w), wanted)
    else:  # on an action groupoid the base adds its force
        minus = Matrix([minus_by_curve(s, (s.x, s.u), a) for a in range(s.m)])
        yield same("right", right(s, s.u), minus + s.rho(s.x).T * s.d_x(s.x, s.u))


@checked(
    "3.6.2-5",
    r"$Ad^\ast_{\tau(h\eta_k)}\mu_k-\mu_{k+1}=0$ is the same equation ($Ad^\ast$ the transpose)",
    how=MATRIX,
    free=("dL_d",),
)
def lie_poisson(s: Sample) -> Iterator[Claim]:
    mu, mu_next = right(s, s.u), right(s, s.w)
    found = adjoint(s, s.u).T * mu - mu_next
    yield same("Ad*μ_k − μ_{k+1}", found, left(s, s.u) - right(s, s.w))


@checked(
    "3.6.2-6", r"$\mu_k=(d\tau^{-1}_{h\eta_k})^\ast \partial l/\partial\xi$ is $F^-$", how=MATRIX
)
def momentum(s: Sample) -> Iterator[Claim]:
    if not s.n:
        g = (s.x, s.u)
        yield same("F⁻", right(s, s.u), [minus_by_curve(s, g, a) for a in range(s.m)])
    dtau = columns(s.m, lambda a: coordinates(s, tangent(s, s.e(a)) * s.tau(-s.h * s.u)))
    yield same("(dτ)*μ = ∂l/∂ξ", dtau.T * right(s, s.u), s.d_u(s.x, s.u))


@checked(
    "3.6.2-7",
    r"$cay(\xi)=(e-\frac\xi2)^{-1}(e+\frac\xi2)$,"
    r" $dcay_\xi\eta=(e-\frac\xi2)^{-1}\eta(e+\frac\xi2)^{-1}$,"
    r" $dcay^{-1}_\xi\eta=(e-\frac\xi2)\eta(e+\frac\xi2)$",
    how=CAYLEY,
)
def cayley(s: Sample) -> Iterator[Claim]:
    minus, plus = half_steps(s, s.u)
    cay = minus.inv() * plus
    yield same("cay", s.tau(s.h * s.u), cay)
    for a in range(s.m):
        eta = hat(s, s.e(a))
        dcay = minus.inv() * eta * plus.inv()
        yield same("Tcay(η) = dcay(η) cay", tangent(s, s.e(a)), dcay * cay)
        moved = tangent(s, s.e(a)) * s.tau(-s.h * s.u)
        yield same("dcay⁻¹ of Tcay(η) cay⁻¹", minus * moved * plus, eta)
        yield same("R", coordinates(s, minus * eta * plus), s.R(s.x, s.u)[:, a])


@checked(
    "3.6.2-8",
    r"$\overleftarrow{e_\gamma}=(e+\frac{h\eta}2)e_\gamma(e-\frac{h\eta}2)$,"
    r" $\overrightarrow{e_\gamma}=(e-\frac{h\eta}2)e_\gamma(e+\frac{h\eta}2)$",
    "so3-for-g",
    how=CAYLEY,
)
def cayley_fields(s: Sample) -> Iterator[Claim]:
    minus, plus = half_steps(s, s.u)
    L, R = s.L(s.x, s.u), s.R(s.x, s.u)
    for a in range(s.m):
        eta = hat(s, s.e(a))
        yield same("left", plus * eta * minus, hat(s, L[:, a]))
        yield same("right", minus * eta * plus, hat(s, R[:, a]))


@checked(
    "3.6.2-9",
    r"the equations with these, and multiplied out:"
    r" $e_\gamma\mp\frac h2[e_\gamma,\eta]-\frac{h^2}4\eta e_\gamma\eta$",
    "Lie-Poincare",
    how=CAYLEY,
)
def cayley_equations(s: Sample) -> Iterator[Claim]:
    if not s.n:
        g, h = (s.x, s.u), (s.x, s.w)
        wanted = [plus_by_curve(s, g, a) - minus_by_curve(s, h, a) for a in range(s.m)]
        yield same("first form", [cayley_side(s, a, s.u, s.w) for a in range(s.m)], wanted)
    L, R = s.L(s.x, s.u), s.R(s.x, s.u)
    eta = hat(s, s.u)
    for a in range(s.m):
        e = hat(s, s.e(a))
        bracket, triple = s.h / 2 * (e * eta - eta * e), s.h**2 / 4 * eta * e * eta
        yield same("at η_k", e - bracket - triple, hat(s, L[:, a]))
        yield same("at η_{k+1}", e + bracket - triple, hat(s, R[:, a]))


# -- the same objects as matrices ------------------------------------------------------------------


def hat(s: Sample, xi: Any) -> Any:
    """The matrix of coordinates."""
    return s.g.algebra.hat(xi)


def coordinates(s: Sample, matrix: Any) -> Any:
    return numbers(s.g.algebra.coordinates(matrix))


def half_steps(s: Sample, u: Any) -> tuple[Any, Any]:
    """e − hη/2 and e + hη/2."""
    a = hat(s, s.h * u / 2)
    return eye(a.rows) - a, eye(a.rows) + a


def tangent(s: Sample, eta: Any) -> Any:
    """T_ξτ(η) at ξ = hu, N×N."""
    return slope(lambda t: s.tau(s.h * s.u + t * eta))


def adjoint(s: Sample, u: Any) -> Any:
    """Ad_{τ(hu)} on coordinates, m×m."""
    g, back = s.tau(s.h * u), s.tau(-s.h * u)
    return columns(s.m, lambda a: coordinates(s, g * hat(s, s.e(a)) * back))


def left(s: Sample, u: Any) -> Any:
    """e←_γ(l) with l = L_d(x, ·), m×1."""
    return s.L(s.x, u).T * s.d_u(s.x, u)


def right(s: Sample, u: Any) -> Any:
    """e→_γ(l) with l = L_d(x, ·), m×1: μ of the Lie–Poisson form."""
    return s.R(s.x, u).T * s.d_u(s.x, u)


def cayley_side(s: Sample, a: int, u: Any, v: Any) -> Any:
    """⟨(e + hη/2) e_γ (e − hη/2), ∂l⟩ − the same at η′ with the signs exchanged."""
    (minus, plus), (minus_next, plus_next) = half_steps(s, u), half_steps(s, v)
    e = hat(s, s.e(a))
    at_k = coordinates(s, plus * e * minus).dot(s.d_u(s.x, u))
    return at_k - coordinates(s, minus_next * e * plus_next).dot(s.d_u(s.x, v))
