"""Section 3.5: the discrete Euler–Lagrange equations in local coordinates, and regularity."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sympy import Matrix, Rational, eye, zeros

from .curves import FL_by_curves, W_by_curves, minus_by_curve, plus_by_curve
from .numbers import EPS, columns, number, numbers, slope
from .rows import Claim, checked, definition, printed, same
from .sample import Sample
from .section_2_groupoids import arrow

definition(
    "3.5-1", r"$(g,h)$ is a solution iff $\overleftarrow{X}(g)(L_d)=\overrightarrow{X}(h)(L_d)$"
)


@checked(
    "3.5-2",
    r"$L^\mu_\gamma \partial_{u^\mu}L_d(x,u)+\rho^i_\gamma \partial_{x^i}L_d(y,v)"
    r"-R^\mu_\gamma \partial_{u^\mu}L_d(y,v)=0$, $y=b(x,u)$",
)
def euler_lagrange(s: Sample) -> Iterator[Claim]:
    g, h, other = (s.x, s.u), (s.y, s.v), (s.y, s.w)
    yield same("y = b(x, u)", s.b(*g), s.y)
    yield same("at a solution", euler_lagrange_side(s, g, h), s.o)
    wanted = [plus_by_curve(s, g, a) - minus_by_curve(s, other, a) for a in range(s.m)]
    yield same("anywhere", euler_lagrange_side(s, g, other), wanted)


@checked(
    "3.5-3",
    r"$(FL_d)^\gamma_\mu=\rho^i_\mu \partial_{x^i}\partial_{u^\gamma}L_d"
    r"-\partial_{u^\gamma}R^\nu_\mu \partial_{u^\nu}L_d"
    r"-R^\nu_\mu \partial_{u^\nu}\partial_{u^\gamma}L_d$",
)
def matrix_FL(s: Sample) -> Iterator[Claim]:
    FL = FL_by_formula(s, s.x, s.u)
    yield same("−∂F⁻_μ/∂u^γ", FL, FL_by_curves(s, s.x, s.u))


@checked(
    "3.5-4",
    r"$F^-_{L_d}(x,u)=(x, -\rho^i_\gamma \partial_{x^i}L_d+R^\mu_\gamma \partial_{u^\mu}L_d)$",
)
def local_legendre(s: Sample) -> Iterator[Claim]:
    g = (s.x, s.u)
    minus = [minus_by_curve(s, g, a) for a in range(s.m)]
    yield same("−v(L_d∘r_h∘i)", s.minus(*g), minus)


@checked(
    "3.5-5",
    r"$TF^-_{L_d}$ has the rows $(I_n,0)$, by the coordinates, and $(\ast,-(FL_d)^T)$",
    "FL-transposed",
    "h-for-h0",
)
def differential(s: Sample) -> Iterator[Claim]:
    ways = zeros(s.n, s.m).col_join(eye(s.m))
    block = columns(s.m, lambda k: s.along(s.minus, ways[:, k]))
    FL = FL_by_curves(s, s.x, s.u)
    yield same("lower right block", block, -FL.T)
    yield printed("FL-transposed", block, -FL)


@checked(
    "3.5-6",
    r"$\Omega_{\gamma\mu}=\Omega(e_\gamma^{(1,0)},e_\mu^{(0,1)})"
    r"=\overleftarrow{e_\mu}(\overrightarrow{e_\gamma}(L_d))$",
)
def omega_matrix(s: Sample) -> Iterator[Claim]:
    left = s.left(s.x, s.u)
    W = columns(s.m, lambda a: s.along(s.minus, left[:, a]))
    yield same("by curves", W, W_by_curves(s, s.x, s.u))


@checked(
    "3.5-7",
    r"$\Omega_{\gamma\mu}=-L^\theta_\mu \partial_{u^\theta}(\rho^i_\gamma \partial_{x^i}L_d"
    r"-R^\nu_\gamma \partial_{u^\nu}L_d)=-L^\theta_\mu(FL_d)^\theta_\gamma$; in matrices"
    r" $W=-(FL)^TL$",
)
def W_is_minus_FL_L(s: Sample) -> Iterator[Claim]:
    W, L, FL = W_by_curves(s, s.x, s.u), s.L(s.x, s.u), FL_by_formula(s, s.x, s.u)
    inner = columns(s.m, lambda a: slope(lambda t: -s.minus(s.x, s.u + t * s.e(a))))
    yield same("first line", W, -inner * L)
    yield same("last line", W, Matrix(s.m, s.m, lambda c, a: -L[:, a].dot(FL[:, c])))
    yield same("in matrices", W, -FL.T * L)


@checked("3.5-remark", r"$L(y,0)=1$, so that $\Omega_{\gamma\mu}(y,0)=-(FL_d)^\mu_\gamma(y,0)$")
def at_the_identities(s: Sample) -> Iterator[Claim]:
    yield same("L(y, 0)", s.L(s.y, s.o), eye(s.m))
    yield same("Ω(y, 0)", W_by_curves(s, s.y, s.o), -FL_by_formula(s, s.y, s.o).T)


@checked(
    "3.5-8", r"$\lambda_\mu(x,u,v)$: the left-hand side of the equations with $y=b(x,u)$ put in"
)
def residual(s: Sample) -> Iterator[Claim]:
    g, h = (s.x, s.u), (s.y, s.w)
    wanted = [plus_by_curve(s, g, a) - minus_by_curve(s, h, a) for a in range(s.m)]
    yield same("λ", lambda_(s, s.x, s.u, s.w), wanted)


@checked("3.5-9", r"$\partial\lambda_\mu/\partial v^\gamma=(FL_d)^\gamma_\mu(y,v)$", free=("L",))
def slope_of_the_residual(s: Sample) -> Iterator[Claim]:
    found = columns(s.m, lambda a: slope(lambda t: lambda_(s, s.x, s.u, s.v + t * s.e(a))))
    yield same("∂λ/∂v", found.T, FL_by_curves(s, s.y, s.v))


@checked(
    "3.5-Proposition 3.2",
    r"near a solution with regular $FL_d$ there is one $v$ to each $(x,u)$, and one $g$ to $h$",
    "alpha-as-index",
)
def evolution_exists(s: Sample) -> Iterator[Claim]:
    near = Rational(1, 10**25)
    x = s.x + near * Matrix(s.n, 1, [1 + i for i in range(s.n)])
    u = s.u + near * Matrix(s.m, 1, [2 - i for i in range(s.m)])
    v = newton(lambda v: lambda_(s, x, u, v), s.v)
    y = s.b(x, u)
    plus = [plus_by_curve(s, (x, u), a) for a in range(s.m)]
    yield same("forward", plus, [minus_by_curve(s, (y, v), a) for a in range(s.m)])

    def backward(w: Any) -> Any:
        """The equations for g = i(y, w): what the coordinates adapted to β are for."""
        return s.plus(*s.inverse((y, w))) - s.minus(y, v)

    w = newton(backward, s.iota(s.x, s.u))
    yield same("and back", arrow(s.inverse((y, w))), arrow((x, u)))


@checked(
    "3.5-10",
    r"in $(\bar x,\bar u)=(x,u)\circ i$:"
    r" $\overleftarrow{e_\gamma}=\rho^i_\gamma(\bar x) \partial_{\bar x^i}"
    r"-R^\mu_\gamma(\bar x,\bar u) \partial_{\bar u^\mu}$,"
    r" $\overrightarrow{e_\gamma}=-L^\mu_\gamma(\bar x,\bar u) \partial_{\bar u^\mu}$",
    "barred-signs",
)
def fields_adapted_to_beta(s: Sample) -> Iterator[Claim]:
    g = (s.x, s.u)
    bar = s.inverse(g)
    pairs = (("left", s.pushed_left, 1, s.right), ("right", s.pushed_right, -1, s.left))
    for name, pushed, sign, fields in pairs:
        found = columns(
            s.m, lambda a, f=pushed, sign=sign: sign * slope(lambda t: arrow(s.inverse(f(g, a, t))))
        )
        yield same(name, found, -fields(*bar))  # [misprint: barred-signs]
        yield printed("barred-signs", found, fields(*bar))


# -- the printed formulas, term by term ------------------------------------------------------------


def euler_lagrange_side(s: Sample, g: Any, h: Any) -> Any:
    """L(x, u)ᵀ ∂L_d/∂u (x, u) + ρ(y)ᵀ ∂L_d/∂x (y, v) − R(y, v)ᵀ ∂L_d/∂u (y, v)."""
    return s.L(*g).T * s.d_u(*g) + s.rho(h[0]).T * s.d_x(*h) - s.R(*h).T * s.d_u(*h)


def lambda_(s: Sample, x: Any, u: Any, v: Any) -> Any:
    return euler_lagrange_side(s, (x, u), (s.b(x, u), v))


def FL_by_formula(s: Sample, x: Any, u: Any) -> Any:
    """FL in row γ, column μ, of the second derivatives of L_d and ∂R/∂u."""
    d_R = [slope(lambda t, a=a: s.R(x, u + t * s.e(a))) for a in range(s.m)]
    middle = Matrix.vstack(*[(d.T * s.d_u(x, u)).T for d in d_R])
    return s.d_xu(x, u).T * s.rho(x) - middle - s.d_uu(x, u) * s.R(x, u)


def newton(f: Any, start: Any) -> Any:
    """The root of m functions of m numbers that is within 10⁻²⁰ of `start`, to 100 digits."""
    jacobian = columns(len(start), lambda a: slope(lambda t: f(start + t * eye(len(start))[:, a])))
    inverse, z = numbers(jacobian.inv().evalf(30)), start
    for _ in range(20):
        step = inverse * f(z)
        z = numbers((z - step).evalf(120))
        if max(abs(number(e)) for e in step) < EPS**2:
            return z
    raise ArithmeticError("Newton's method did not converge")
