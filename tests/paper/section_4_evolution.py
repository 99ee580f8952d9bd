"""Sections 4.2 and 4.3: general discrete Euler–Lagrange evolution operators, and their use."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sympy import Integer, Matrix, Rational, symbols, zeros

from discmech.integrators import pair

from .bisections import Arrow, Translations
from .curves import W_by_formula, minus_by_curve, plus_by_curve, rank_of_legendre, singular
from .numbers import columns, mixed_slope, slope
from .rows import MATRIX, SYMBOLIC, Claim, checked, definition, printed, same
from .sample import Sample, rank
from .section_2_groupoids import arrow
from .section_3_equations import newton


@checked(
    "4.2-1",
    r"$(g_0,h_0)$ is a solution: $\overleftarrow{X}(g_0)(L_d)-\overrightarrow{X}(h_0)(L_d)=0$",
)
def a_solution(s: Sample) -> Iterator[Claim]:
    yield same("by curves", _by_curves(s, (s.x, s.u), (s.y, s.v)), s.o)


definition("4.2-2", r"$x_0=\beta(g_0)=\alpha(h_0)$")


@checked(
    "4.2-3",
    r"the equations are $\overleftarrow{e_\gamma}(g)(L_d)-\overrightarrow{e_\gamma}(h)(L_d)=0$: of"
    r" a section $f^\gamma e_\gamma$ both sides have the factors $f^\gamma(\beta(g))$",
)
def equations(s: Sample) -> Iterator[Claim]:
    f = Matrix(s.m, 1, [1 + a + sum(y**2 for y in s.y) for a in range(s.m)])  # at β(g) = α(h)
    g, h = (s.x, s.u), (s.b(s.x, s.u), s.w)

    def action(t: Any) -> Any:
        """L_d along g·c(t) and c(t)⁻¹·h of the curve with velocity f^γ e_γ."""
        moved = s.times(s.inverse((h[0], t * f)), h)
        return s.L_d(g[0], s.p(*g, t * f)) + s.L_d(*moved)

    yield same("f^γ e_γ", slope(action), f.dot(s.plus(*g) - s.minus(*h)))


@checked(
    "4.2-4",
    r"they are $(TL_{\Sigma_0}\overleftarrow{e_\gamma}(g_W))(L_d)"
    r"-(TR_{\Upsilon_0}\overrightarrow{e_\gamma}(h_W))(L_d)=0$",
    free=("L_d",),
)
def pushed_fields(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    (x, u), (y, v) = to.g_W, to.h_W
    L, R, rho = s.L(x, u), s.R(y, v), s.rho(y)
    left = [slope(lambda t, a=a: to.of_left(x, u + t * L[:, a])) for a in range(s.m)]
    right = [
        slope(lambda t, a=a: to.of_right(y - t * rho[:, a], v + t * R[:, a])) for a in range(s.m)
    ]
    wanted = _by_curves(s, to.left(to.g_W), to.right(to.h_W))
    yield same("anywhere", Matrix(left) - Matrix(right), wanted)


@checked(
    "4.2-5",
    r"or $\overleftarrow{e_\gamma}(g_W)(L_d\circ L_{\Sigma_0})"
    r"-\overrightarrow{e_\gamma}(h_W)(L_d\circ R_{\Upsilon_0})=0$",
)
def composed_with_translations(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    found = [_left_by_curve(to, to.g_W, a) - _right_by_curve(to, to.h_W, a) for a in range(s.m)]
    yield same("anywhere", found, _by_curves(s, to.left(to.g_W), to.right(to.h_W)))
    unit = (s.y, zeros(s.m, 1))
    found = [_left_by_curve(to, unit, a) - _right_by_curve(to, unit, a) for a in range(s.m)]
    yield same("at the solution", found, s.o)


@checked("4.2-6", r"$(g,h)=(L_{\Sigma_0}(g_W),R_{\Upsilon_0}(h_W))$ is composable iff $y=b(x,u)$")
def composable(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    yield same("β(L_Σ(g_W)) = b(x, u)", s.b(*to.left(to.g_W)), s.b(*to.g_W))
    yield same("α(R_Υ(h_W)) = y", to.right(to.h_W)[0], s.b(*to.left(to.g_W)))


@checked(
    "4.2-7",
    r"$L^\gamma_\mu \partial_{u^\gamma}(L_d\circ L_{\Sigma_0})(x,u)"
    r"+\rho^i_\mu \partial_{x^i}(L_d\circ R_{\Upsilon_0})(y,v)"
    r"-R^\gamma_\mu \partial_{u^\gamma}(L_d\circ R_{\Upsilon_0})(y,v)=0$",
    free=("L_d",),
)
def local_equations(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    (x, u), (y, v) = to.g_W, to.h_W
    left, right = _d_u(s, to.of_left, x, u), _d_u(s, to.of_right, y, v)
    found = s.L(x, u).T * left + s.rho(y).T * _d_x(s, to.of_right, y, v) - s.R(y, v).T * right
    yield same("anywhere", found, _by_curves(s, to.left(to.g_W), to.right(to.h_W)))


@checked(
    "4.2-8",
    r"$(FL_d)^\gamma_\mu=\rho^i_\mu \partial_{x^i}\partial_{u^\gamma}(L_d\circ R_{\Upsilon_0})"
    r"-\partial_{u^\gamma}R^\nu_\mu \partial_{u^\nu}(L_d\circ R_{\Upsilon_0})"
    r"-R^\nu_\mu \partial_{u^\nu}\partial_{u^\gamma}(L_d\circ R_{\Upsilon_0})$",
    free=("L_d",),
    dear=True,
)
def matrix_FL(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    y, v = to.h_W

    def by_curves(c: int, a: int) -> Any:
        return mixed_slope(lambda t, r: _moved_right(to, (y, v + r * s.e(c)), a, t))

    found = _FL_by_formula(s, to.of_right, y, v, s.R(y, v))
    yield same("−∂/∂u^γ e→_μ(L_d∘R_Υ)", found, Matrix(s.m, s.m, by_curves))


@checked(
    "4.2-9",
    r"$R_{\Upsilon_0}$ maps $\alpha^{-1}(x_0)$ to itself, by the coordinates, and onto: $h'$ is"
    r" $R_{\Upsilon_0}(h)$ for $h=h'[(\Upsilon_0)_\alpha(x)]^{-1}$ with"
    r" $(\beta\circ(\Upsilon_0)_\alpha)(x)=\beta(h')$",
    "local-diffeomorphism",
)
def onto_the_fibre(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    near = Rational(1, 10**25) * Matrix(s.m, 1, [2 - a for a in range(s.m)])
    wanted = s.y, s.v + near
    end = s.b(*wanted)
    x = newton(lambda x: s.b(*to.upsilon_alpha(x)) - end, s.y) if s.n else s.y
    h = s.times(wanted, s.inverse(to.upsilon_alpha(x)))
    yield same("R_Υ(h) = h′", arrow(to.right(h)), arrow(wanted))
    yield same("β(h) = x", s.b(*h), x)


definition(
    "4.2-10",
    r"$w^\gamma(h_0)=T_{\epsilon(x_0)}R_{\Upsilon_0}(\partial_{u^\gamma})$,"
    r" a basis of $\ker T_{h_0}\alpha$",
    "upper-w",
)


@checked("4.2-11", r"$\overrightarrow{e_\mu}(h)=TR_{\Upsilon_0}(\overrightarrow{e_\mu}(h_W))$")
def right_fields(s: Sample) -> Iterator[Claim]:
    to = Translations(s)

    def moved(a: int, t: Any) -> Any:
        return arrow(to.right(s.pushed_right(to.h_W, a, t)))

    found = columns(s.m, lambda a: -slope(lambda t: moved(a, t)))
    yield same("by curves", found, s.right(*to.right(to.h_W)))


@checked(
    "4.2-12",
    r"$\overrightarrow{e_\mu}(L_d)\circ R_{\Upsilon_0}=-\rho^i_\mu \partial_{x^i}(L_d\circ"
    r" R_{\Upsilon_0})+R^\nu_\mu \partial_{u^\nu}(L_d\circ R_{\Upsilon_0})$; its derivative along"
    r" $w^\gamma$ is $-(FL_d)^\gamma_\mu(x_0,0)$",
    dear=True,
)
def right_derivative(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    h = to.right(to.h_W)
    wanted = [minus_by_curve(s, h, a) for a in range(s.m)]
    yield same("e→_μ(L_d) at R_Υ(h_W)", _minus(to, *to.h_W), wanted)
    FL = _FL_by_formula(s, to.of_right, s.y, s.o, s.R(s.y, s.o))
    along = columns(s.m, lambda c: slope(lambda t: s.minus(*to.right((s.y, t * s.e(c))))))
    yield same("w^γ(e→_μ(L_d)) = −FL", along.T, -FL)


@checked(
    "4.2-13",
    r"$F^-_{L_d}(x,u)=(x,-\rho^i_\gamma \partial_{x^i}(L_d\circ R_{\Upsilon_0})"
    r"+R^\mu_\gamma \partial_{u^\mu}(L_d\circ R_{\Upsilon_0}))$",
)
def legendre(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    yield same("F⁻ at R_Υ(h_W)", _minus(to, *to.h_W), s.minus(*to.right(to.h_W)))


@checked("4.2-14", r"in $(\bar x,\bar u)=(x,u)\circ i$ composable iff $\bar y=b(\bar x,\bar u)$")
def composable_barred(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    (bar_y, _), bar_h = s.inverse(to.g_W), s.inverse(to.h_W)
    yield same("ȳ = b(x̄, ū)", bar_y, s.b(*bar_h))
    yield same("β(L_Σ(g_W)) = ȳ", s.b(*to.left(to.g_W)), bar_y)


@checked(
    "4.2-15",
    r"$0=-\rho^i_\mu \partial_{\bar x^i}(L_d\circ L_{\Sigma_0})+R^\gamma_\mu"
    r" \partial_{\bar u^\gamma}(L_d\circ L_{\Sigma_0})-L^\gamma_\mu \partial_{\bar u^\gamma}"
    r"(L_d\circ R_{\Upsilon_0})$ in barred coordinates",
    "x0-u0-v0",
    free=("L_d",),
)
def barred_equations(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    g, h = s.inverse(to.g_W), s.inverse(to.h_W)
    left = s.R(*g).T * _d_u(s, to.of_left_barred, *g)
    left -= s.rho(g[0]).T * _d_x(s, to.of_left_barred, *g)
    right = s.L(*h).T * _d_u(s, to.of_right_barred, *h)
    wanted = -_by_curves(s, to.left(to.g_W), to.right(to.h_W))
    yield same("anywhere", left - right, wanted)


@checked(
    "4.2-16",
    r"$\overline{(FL)}^\gamma_\mu=\rho^i_\mu \partial_{\bar x^i}\partial_{\bar u^\gamma}"
    r"(L_d\circ L_{\Sigma_0})-\partial_{\bar u^\gamma}R^\nu_\mu \partial_{\bar u^\nu}"
    r"(L_d\circ L_{\Sigma_0})-R^\nu_\mu \partial_{\bar u^\nu}\partial_{\bar u^\gamma}"
    r"(L_d\circ L_{\Sigma_0})$",
    "implicit2",
    "FL-without-d",
    free=("L", "L_d"),
    dear=True,
)
def matrix_barred_FL(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    y, v = s.inverse(to.g_W)

    def by_curves(c: int, a: int) -> Any:
        def surface(t: Any, r: Any) -> Any:
            near = s.inverse((y, v + r * s.e(c)))
            return s.L_d(*to.left(s.pushed_left(near, a, t)))

        return mixed_slope(surface)

    R, wanted = s.R(y, v), Matrix(s.m, s.m, by_curves)
    yield same("∂/∂v̄^γ e←_μ(L_d∘L_Σ)", _FL_by_formula(s, to.of_left_barred, y, v, R), wanted)
    wrong = _FL_by_formula(s, to.of_right_barred, y, v, s.L(y, v))
    yield printed("implicit2", wrong, wanted)


@checked(
    "4.2-Theorem 4.9",
    r"equivalent: $FL_d(x_0,0)$ regular; $\Omega$ non-degenerate at $h_0$; $F^-$ a local"
    r" diffeomorphism there. All three have one rank, also where it is $m-1$",
    free=("L",),
    dear=True,
)
def regular_at_h(s: Sample) -> Iterator[Claim]:
    found, h = [], (s.y, s.v)
    for at in (s, singular(s, h)):
        to = Translations(at)
        FL = _FL_by_formula(at, to.of_right, s.y, s.o, at.R(s.y, s.o))
        found += [rank(FL), rank(W_by_formula(at, h)), rank_of_legendre(at, "-", h)]
    yield same("ranks", found, 3 * [s.m] + 3 * [s.m - 1])


@checked(
    "4.2-Theorem 4.10",
    r"equivalent: $FL_d(x_0,0)$ and $\overline{FL}(x_0,0)$ regular; $\Omega$ non-degenerate at"
    r" $g_0$ and $h_0$; $F^+$ and $F^-$ local diffeomorphisms there. At $g_0$ the matrix is"
    r" $\overline{FL}$ of $L_d\circ L_{\Sigma_0}$",
    "implicit2",
    dear=True,
)
def regular_at_both(s: Sample) -> Iterator[Claim]:
    found, g = [], (s.x, s.u)
    for at in (s, singular(s, g)):
        to = Translations(at)
        bar = _FL_by_formula(at, to.of_left_barred, s.y, s.o, at.R(s.y, s.o))
        found += [rank(bar), rank(W_by_formula(at, g))]
        found += [rank_of_legendre(at, sign, g) for sign in "+-"]
    yield same("ranks", found, 4 * [s.m] + 4 * [s.m - 1])
    wrong = _FL_by_formula(at, to.of_right_barred, s.y, s.o, at.L(s.y, s.o))
    yield printed("implicit2", rank(wrong), s.m - 1)


@checked(
    "4.2-counterexample",
    r"to Theorem 4.10 with (40) as printed: $M\times M$, $h=1$, $L_d=\frac12a^2b$ on arrows"
    r" $(a,b)$, $g_0=(0,1)$, $h_0=(1,0)$ is a solution where both printed matrices are regular,"
    r" but $\Omega$ is degenerate at $g_0$ and $\Psi(a,b)=(b,-\frac{a^2}{2b})$ no diffeomorphism",
    "implicit2",
    how=SYMBOLIC,
)
def counterexample() -> Iterator[Claim]:
    a, b, x, u = symbols("a b x u")
    G, one = pair(1), Integer(1)
    S = a**2 * b / 2

    def on(first: Any, second: Any) -> Any:
        return S.subs({a: first, b: second}, simultaneous=True)

    def at(expression: Any, first: Any, second: Any) -> Any:
        return expression.subs({a: first, b: second}, simultaneous=True)

    evolved = -(a**2) / (2 * b)
    later = S.diff(a).subs({a: b, b: evolved}, simultaneous=True)
    yield same("Ψ solves D₂S + D₁S = 0", S.diff(b), -later)
    yield same("Ψ(g₀) = h₀", [one, at(evolved, 0, 1)], [1, 0])
    yield same("∂Ψ/∂a = 0 at g₀", at(evolved.diff(a), 0, 1), 0)
    # Σ₀ and Υ₀ are the translations of the base by 1 and by −1; (x̄, ū) = (x, u)∘i
    base, fibre = G.target(Matrix([x]), Matrix([u]), 1)[0], G.inversion(Matrix([x]), Matrix([u]), 1)
    of_right, of_left = on(x, x + u - 1), on(x - 1, x + u)
    barred_right, barred_left = (
        f.subs({x: base, u: fibre[0]}, simultaneous=True) for f in (of_right, of_left)
    )

    def matrix(f: Any) -> Any:
        """ρ ∂²f/∂x∂u − ∂²f/∂u∂u with L = R = 1 at (x₀, 0)."""
        return (f.diff(x, u) - f.diff(u, 2)).subs({x: 1, u: 0})

    yield same("FL at h₀, and Ω there", [matrix(of_right), at(S.diff(a, b), 1, 0)], [1, 1])
    yield same("mended (40), and Ω at g₀", [matrix(barred_left), at(S.diff(a, b), 0, 1)], [0, 0])
    yield printed("implicit2", matrix(barred_right), at(S.diff(a, b), 0, 1))


definition("4.2-17", r"$\Xi$: to each $h$ the $g$ with $(g,h)$ a solution")


@checked("4.2-18", r"$\Psi\circ\Xi=id$, $\Xi\circ\Psi=id$")
def forth_and_back(s: Sample) -> Iterator[Claim]:
    to, near = Translations(s), Rational(1, 10**25)
    x = s.y + near * Matrix(s.n, 1, [1 + i for i in range(s.n)])
    u = near * Matrix(s.m, 1, [2 - i for i in range(s.m)])
    plus, y = s.plus(*to.left((x, u))), s.b(x, u)
    v = newton(lambda v: plus - s.minus(*to.right((y, v))), s.o)
    minus = [minus_by_curve(s, to.right((y, v)), a) for a in range(s.m)]
    left = to.left((x, u))
    yield same("Ψ", [plus_by_curve(s, left, a) for a in range(s.m)], minus)
    minus = s.minus(*to.right((y, v)))
    bar = newton(lambda w: s.plus(*to.left(s.inverse((y, w)))) - minus, s.o)
    yield same("Ξ(Ψ(g)) = g", arrow(s.inverse((y, bar))), arrow((x, u)))


@checked(
    "4.3-1",
    r"on a group, with $g\in g_IW$ and $h\in Wh_J$: $(TL_{g_I}\overleftarrow{e_\gamma}(g_I^{-1}g))"
    r"(L_d)-(TR_{h_J}\overrightarrow{e_\gamma}(hh_J^{-1}))(L_d)=0$",
    how=MATRIX,
)
def with_two_elements(s: Sample) -> Iterator[Claim]:
    g, h = (s.x, s.u), (s.y, s.v)
    first = (s.x, s.w)  # g_I, from where g starts
    near_g = s.times(s.inverse(first), g)
    last = s.inverse((s.b(*h), s.w))  # h_J, to where h ends
    near_h = s.times(h, s.inverse(last))
    found = [
        slope(lambda t, a=a: s.L_d(*s.times(first, s.pushed_left(near_g, a, t))))
        + slope(lambda t, a=a: s.L_d(*s.times(s.pushed_right(near_h, a, t), last)))
        for a in range(s.m)
    ]
    yield same("at a solution", found, s.o)
    yield same("anywhere", found, _by_curves(s, g, h))


# -- sides -----------------------------------------------------------------------------------------


def _by_curves(s: Sample, g: Arrow, h: Arrow) -> Any:
    """e←_γ(g)(L_d) − e→_γ(h)(L_d), m×1."""
    return Matrix([plus_by_curve(s, g, a) - minus_by_curve(s, h, a) for a in range(s.m)])


def _left_by_curve(to: Translations, g: Arrow, a: int) -> Any:
    return slope(lambda t: to.of_left(*to.s.pushed_left(g, a, t)))


def _moved_right(to: Translations, h: Arrow, a: int, t: Any) -> Any:
    return to.of_right(*to.s.pushed_right(h, a, t))


def _right_by_curve(to: Translations, h: Arrow, a: int) -> Any:
    return -slope(lambda t: _moved_right(to, h, a, t))


def _d_u(s: Sample, function: Any, x: Any, u: Any) -> Any:
    return Matrix([slope(lambda t, a=a: function(x, u + t * s.e(a))) for a in range(s.m)])


def _d_x(s: Sample, function: Any, x: Any, u: Any) -> Any:
    def unit(i: int) -> Any:
        return Matrix(s.n, 1, lambda k, _: int(k == i))

    found = [slope(lambda t, i=i: function(x + t * unit(i), u)) for i in range(s.n)]
    return Matrix(s.n, 1, found)


def _minus(to: Translations, x: Any, u: Any) -> Any:
    """−ρ^i_γ ∂(L_d∘R_Υ)/∂x^i + R^μ_γ ∂(L_d∘R_Υ)/∂u^μ."""
    s = to.s
    of_x, of_u = _d_x(s, to.of_right, x, u), _d_u(s, to.of_right, x, u)
    return s.R(x, u).T * of_u - s.rho(x).T * of_x


def _FL_by_formula(s: Sample, function: Any, x: Any, u: Any, second: Any) -> Any:
    """ρ ∂²f/∂x∂u − ∂R/∂u ∂f/∂u − `second` ∂²f/∂u∂u in row γ, column μ."""
    rho, gradient = s.rho(x), _d_u(s, function, x, u)

    def entry(c: int, a: int) -> Any:
        turned = slope(lambda t: s.R(x, u + t * s.e(c)))[:, a].dot(gradient)

        def surface(t: Any, r: Any) -> Any:
            return function(x + t * rho[:, a], u + r * s.e(c))

        def inner(t: Any, r: Any) -> Any:
            return function(x, u + t * second[:, a] + r * s.e(c))

        across = mixed_slope(surface) if s.n else 0
        return across - turned - mixed_slope(inner)

    return Matrix(s.m, s.m, entry)
