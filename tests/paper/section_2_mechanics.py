"""Sections 2.2 to 2.6: discrete Euler–Lagrange equations, Poincaré–Cartan sections."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sympy import Matrix, Rational, zeros

from .curves import (
    W_by_curves,
    W_by_formula,
    left_of_minus,
    minus_by_curve,
    plus_by_curve,
    rank_of_legendre,
    right_of_plus,
    singular,
)
from .numbers import columns, slope
from .rows import Claim, checked, definition, printed, same
from .sample import Sample, rank
from .section_2_groupoids import arrow, combined, lie_brackets

definition("2.2-1", "the structure maps")
# the sequence ends with g_N [misprint: product-to-n]
definition("2.2-2", r"admissible sequences: $g_1\cdots g_N=g$", "product-to-n")


@checked(
    "2.2-3",
    r"the sum of $\overleftarrow{X_k}(g_k)(L_d)-\overrightarrow{X_k}(g_{k+1})(L_d)$ is the"
    r" variation of $L_d(g_1)+\dots+L_d(g_N)$ with $g_1\cdots g_N$ fixed; here $N=3$",
)
def variation(s: Sample) -> Iterator[Claim]:
    first, second = (s.x, s.u), (s.y, s.w)
    third = (s.b(*second), s.v)
    whole = s.times(s.times(first, second), third)
    for a in range(s.m):
        b = (a + 1) % s.m  # another section at the second joint

        def moved(t: Any, a: int = a, b: int = b) -> list[Any]:
            """g₁c(t), c(t)⁻¹g₂k(t), k(t)⁻¹g₃."""
            middle = s.pushed_left(s.pushed_right(second, a, t), b, t)
            return [s.pushed_left(first, a, t), middle, s.pushed_right(third, b, t)]

        one, two, three = moved(Rational(1, 30))
        yield same("product", arrow(s.times(s.times(one, two), three)), arrow(whole))
        wanted = s.plus(*first)[a] - s.minus(*second)[a] + s.plus(*second)[b] - s.minus(*third)[b]
        yield same("variation", slope(lambda t: sum(s.L_d(*g) for g in moved(t))), wanted)


@checked("2.2-4", r"$N=2$: $\overleftarrow{X}(g)(L_d)-\overrightarrow{X}(h)(L_d)=0$")
def two_arrows(s: Sample) -> Iterator[Claim]:
    g, h = (s.x, s.u), (s.y, s.v)
    gap = [plus_by_curve(s, g, a) - minus_by_curve(s, h, a) for a in range(s.m)]
    yield same("at a solution", gap, [0] * s.m)


definition("2.3-1", r"$P^\tau G=V\beta\oplus V\alpha$")
definition("2.3-2", r"anchor of $P^\tau G$: $(X_g,Y_g)\mapsto X_g+Y_g$")


@checked(
    "2.3-3",
    r"the bracket $(-\overrightarrow{[X,X']},\overleftarrow{[Y,Y']})$ is the one that the anchor"
    r" respects",
)
def prolonged_bracket(s: Sample) -> Iterator[Claim]:
    def anchored(x: Any, u: Any) -> Any:
        return s.right(x, u) + s.left(x, u)

    fields = [-c for c in s.C(s.x)]
    wanted = zip(
        combined(s, fields, s.right(s.x, s.u)), combined(s, s.C(s.y), s.left(s.x, s.u)), strict=True
    )
    yield same("bracket", lie_brackets(s, anchored, anchored), [a + b for a, b in wanted])


definition("2.3-4", r"$\Theta^-(X_g,Y_g)=-X_g(L_d)$, $\Theta^+(X_g,Y_g)=Y_g(L_d)$")
definition("2.3-5", r"$X^{(1,0)}=(\overrightarrow{X},0)$, $X^{(0,1)}=(0,\overleftarrow{X})$")


@checked("2.3-text", r"$dL_d=\Theta^+-\Theta^-$, so $d\Theta^+=d\Theta^-$")
def d_of_theta(s: Sample) -> Iterator[Claim]:
    dL = [s.d_x(s.x, s.u).T, s.d_u(s.x, s.u).T]
    gradient = dL[0].row_join(dL[1])
    g = (s.x, s.u)
    minus, plus = ([of(s, g, a) for a in range(s.m)] for of in (minus_by_curve, plus_by_curve))
    yield same("dL_d on (1,0)", gradient * s.right(*g), minus)
    yield same("dL_d on (0,1)", gradient * s.left(*g), plus)
    # dΘ(X, Y) = X(Θ(Y)) − Y(Θ(X)) − Θ([X, Y]) with [X^(1,0), Y^(0,1)] = 0
    yield same("dΘ⁺ = dΘ⁻ on (1,0), (0,1)", right_of_plus(s), left_of_minus(s))


@checked("2.3-6", r"$\Omega$ vanishes on two $(1,0)$ and on two $(0,1)$", "X-at-beta")
def omega_on_equals(s: Sample) -> Iterator[Claim]:
    # dΘ⁻ on (1,0): Θ⁻ = −F⁻ there and the bracket is −C; dΘ⁺ on (0,1): Θ⁺ = F⁺ and C at β(g)
    minus, plus = s.minus(s.x, s.u), s.plus(s.x, s.u)
    right, left = s.right(s.x, s.u), s.left(s.x, s.u)
    d_minus = columns(s.m, lambda a: s.along(s.minus, right[:, a]))
    d_plus = columns(s.m, lambda a: s.along(s.plus, left[:, a]))
    at_start, at_end = s.C(s.x), s.C(s.y)
    zero = zeros(s.m)
    on_minus = sum((minus[c] * at_start[c] for c in range(s.m)), zero)
    on_plus = sum((plus[c] * at_end[c] for c in range(s.m)), zero)
    yield same("dΘ⁻ on (1,0)", d_minus - d_minus.T - on_minus, zero)
    yield same("dΘ⁺ on (0,1)", d_plus.T - d_plus - on_plus, zero)


@checked(
    "2.3-7",
    r"$\Omega(X_\gamma^{(1,0)},Y_\mu^{(0,1)})=\overleftarrow{Y_\mu}(\overrightarrow{X_\gamma}(L_d))"
    r"=\overrightarrow{X_\gamma}(\overleftarrow{Y_\mu}(L_d))$, which is $d\Theta^\pm$",
    "omega-sign",
)
def omega_on_both(s: Sample) -> Iterator[Claim]:
    W = W_by_curves(s, s.x, s.u)
    d_theta = right_of_plus(s)
    yield same("e←(e→(L_d))", left_of_minus(s), W)
    yield same("Ω = dΘ⁺", d_theta, W)
    yield printed("omega-sign", -d_theta, W)


@checked(
    "2.3-symplecticity",
    r"$\Psi$ keeps $\Omega$: $(P\Psi)^\ast\Omega=\Omega$ at a solution $(g,\Psi(g))$",
)
def symplectic(s: Sample) -> Iterator[Claim]:
    n, m, g, h = s.n, s.m, (s.x, s.u), (s.y, s.v)
    fields = s.right(*g).row_join(s.left(*g))
    dy = columns(2 * m, lambda k: s.along(s.b, fields[:, k]))
    d_plus = columns(2 * m, lambda k: s.along(s.plus, fields[:, k]))
    d_minus = columns(2 * m, lambda k: slope(lambda t: s.minus(s.y + t * dy[:, k], s.v)))
    dv = (-s.FL(*h).T).LUsolve(d_plus - d_minus)
    only_c = zeros(m).row_join(Matrix.eye(m))
    a_star, c_star = -only_c, s.L(*h).LUsolve(dv + s.R(*h) * only_c)
    yield same("a* = −c moves the base", dy, -s.rho(s.y) * a_star)
    here, there = W_by_formula(s, g), W_by_formula(s, h)
    pulled = a_star.T * there * c_star
    zero = zeros(m)
    wanted = zero.row_join(here).col_join(-here.T.row_join(zero))
    yield same("pullback", pulled - pulled.T, wanted)
    assert dy.shape == (n, 2 * m)


# the two properties are what an evolution operator is; that there is one: Theorems 4.9 and 4.10
definition("2.4-1", r"$\overleftarrow{X}(g)(L_d)-\overrightarrow{X}(\Psi(g))(L_d)=0$")


@checked("2.5-1", r"$F^-L_d(h)(v)=-v(L_d\circ r_h\circ i)$")
def legendre_minus(s: Sample) -> Iterator[Claim]:
    h = (s.y, s.v)
    yield same("F⁻", [minus_by_curve(s, h, a) for a in range(s.m)], s.minus(*h))


@checked("2.5-2", r"$F^+L_d(g)(v)=v(L_d\circ l_g)$")
def legendre_plus(s: Sample) -> Iterator[Claim]:
    g = (s.x, s.u)
    yield same("F⁺", [plus_by_curve(s, g, a) for a in range(s.m)], s.plus(*g))


@checked(
    "2.5-3",
    r"$F^-L_d=\overrightarrow{X_\gamma}(L_d)X^\gamma$,"
    r" $F^+L_d=\overleftarrow{Y_\mu}(L_d)Y^\mu$",
    "V-without-name",
    free=("L_d",),
)
def legendre_components(s: Sample) -> Iterator[Claim]:
    g = (s.x, s.u)

    def L_d(x: Any, u: Any) -> Any:
        return Matrix([s.L_d(x, u)])

    for name, fields, by_curve in (("−", s.right, minus_by_curve), ("+", s.left, plus_by_curve)):
        at = fields(*g)
        found = columns(s.m, lambda a, f=at: s.along(L_d, f[:, a]))
        yield same(name, found, [by_curve(s, g, a) for a in range(s.m)])


@checked("2.6-text", r"equivalent: $L_d$ regular; $F^-L_d$ a local diffeomorphism; $F^+L_d$ one")
def equivalent_conditions(s: Sample) -> Iterator[Claim]:
    arrow_, found = (s.x, s.u), []
    for at in (s, singular(s)):
        found += [rank(W_by_formula(at, arrow_)), *(rank_of_legendre(at, sign) for sign in "-+")]
    yield same("one rank at a regular and at a singular point", found, 3 * [s.m] + 3 * [s.m - 1])
