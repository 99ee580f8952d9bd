"""Section 3.7: action groupoids."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import mpmath
from mpmath.libmp import to_rational
from sympy import Matrix, Rational, eye, zeros

from discmech.integrators import cayley, lie_group, pair, product, so
from discmech.integrators.groupoids.action import UserAction

from .curves import minus_by_curve, plus_by_curve
from .numbers import DIGITS, columns, slope
from .rows import ACTIONS, SYMBOLIC, Claim, broken, checked, printed, same
from .sample import Sample
from .section_2_groupoids import arrow
from .section_3_group import adjoint


@checked(
    "3.7-1", r"$\alpha(x,g)=x$, $\beta(x,g)=xg$, $m=(x,gg')$, $i(x,g)=(xg,g^{-1})$", how=ACTIONS
)
def structure(s: Sample) -> Iterator[Claim]:
    g, h = s.tau(s.h * s.u), s.tau(s.h * s.v)
    yield same("β", s.b(s.x, s.u), act(s, s.x, g))
    yield same("ε", act(s, s.x, s.tau(s.o)), s.x)
    yield same("m", g * h, s.tau(s.h * s.p(s.x, s.u, s.v)))
    yield same("β of a product", act(s, s.x, g * h), s.b(s.y, s.v))
    yield same("i", g * s.tau(s.h * s.iota(s.x, s.u)), eye(g.rows))


@checked(
    "3.7-2",
    r"$\overleftarrow{C_\eta}=(0,\overleftarrow\eta)$,"
    r" $\overrightarrow{C_\eta}=(-\eta_M,\overrightarrow\eta)$",
    "values-in-g",
    how=ACTIONS,
)
def fields_of_constant_sections(s: Sample) -> Iterator[Claim]:
    g, h = s.tau(s.h * s.u), (s.x, s.u)
    for a in range(s.m):
        # η is h times the basis element: the section ∂/∂u^γ
        eta = s.g.algebra.hat(s.h * s.e(a))
        left = slope(lambda t, a=a: arrow(s.pushed_left(h, a, t)))
        right = -slope(lambda t, a=a: arrow(s.pushed_right(h, a, t)))
        yield same("−η_M", right[: s.n, :], -s.h * generator(s, s.x, a))
        for field, wanted in ((left, g * eta), (right, eta * g)):
            du = field[s.n :, :]
            moved = slope(lambda t, du=du: s.tau(s.h * (s.u + t * du)))
            yield same("η← and η→", moved, wanted)


@checked(
    "3.7-3",
    r"$\overleftarrow{C_\eta}(x_k,g_k)(L_d)-\overrightarrow{C_\eta}(x_kg_k,g_{k+1})(L_d)=0$",
    "L-for-L_d",
    "g-without-tilde",
    how=ACTIONS,
    free=("τ",),
)
def equations(s: Sample) -> Iterator[Claim]:
    """As printed, L of the midpoint rule, L_d = h L(xτ(hu/2), u), in place of L_d."""
    g, h = (s.x, s.u), (s.b(s.x, s.u), s.v)

    def side(function: Callable[[Any, Any], Any]) -> list[Any]:
        def along(pushed: Any, arrow: Any, a: int) -> Any:
            return slope(lambda t: function(*pushed(arrow, a, t)))

        return [along(s.pushed_left, g, a) + along(s.pushed_right, h, a) for a in range(s.m)]

    yield same("at a solution", side(s.L_d), s.o)  # [misprint: L-for-L_d]

    def L(x: Any, u: Any) -> Any:
        return s.L_d(act(s, x, s.tau(-s.h * u / 2)), u) / s.h

    yield printed("L-for-L_d", side(L), s.o)


@checked(
    "3.7-4",
    r"$\Phi_{\xi_M}(t,x)=x\exp(t\xi)$ is the flow of $\xi_M$; the step stands before"
    r" $(e_\gamma)_M$",
    "flow-step",
    how=ACTIONS,
    spoilt=True,
)
def flow_of_the_action(s: Sample) -> Iterator[Claim]:
    # of ξ = e_γ after a finite time, where exp is not τ [misprint: flow-step]
    time = Rational(2, 7)
    for a in range(s.m):
        xi = s.g.algebra.hat(s.e(a))

        def flow(t: Any, xi: Any = xi) -> Any:
            return act(s, s.x, exponential_of(t * xi))

        def by_retraction(t: Any, a: int = a) -> Any:
            return act(s, s.x, s.tau(t * s.e(a)))

        there = flow(time)
        found = slope(lambda t, flow=flow: flow(time + t))
        wanted = s.x, generator(s, there, a)
        yield same("Φ(0, x) = x, dΦ/dt = ξ_M(Φ)", [flow(0 * time), found], wanted)
        moved = slope(lambda t, a=a, there=there: s.b(*s.near_unit(there, a, t)))
        yield same("hξ_M is ∂b/∂u", s.h * found, moved)
        with_step = slope(lambda t, flow=flow: flow(s.h * (time + t)))
        yield printed("flow-step", with_step, generator(s, flow(s.h * time), a))
        if s.g.tau is cayley:
            found = slope(lambda t, way=by_retraction: way(time + t))
            yield broken("Φ by τ in place of exp", found, generator(s, by_retraction(time), a))


@checked(
    "3.7-5",
    r"$\overleftarrow{C_{e_\gamma}}=(0,d\tau^{-1}_{h\eta}(Ad_{\tau(h\eta)}e_\gamma))$,"
    r" $\overrightarrow{C_{e_\gamma}}=(-h(e_\gamma)_M,d\tau^{-1}_{h\eta}(e_\gamma))$",
    how=ACTIONS,
)
def fields(s: Sample) -> Iterator[Claim]:
    g = (s.x, s.u)
    R = s.R(*g)
    base = columns(s.m, lambda a: -s.h * generator(s, s.x, a))
    left = columns(s.m, lambda a: slope(lambda t: arrow(s.pushed_left(g, a, t))))
    right = columns(s.m, lambda a: -slope(lambda t: arrow(s.pushed_right(g, a, t))))
    yield same("left", left, zeros(s.n, s.m).col_join(R * adjoint(s, s.u)))
    yield same("right", right, base.col_join(R))


@checked(
    "3.7-6",
    r"$d\tau^{-1}_{h\eta_k}(Ad_{\tau(h\eta_k)}e_\gamma)(l_{x_k})"
    r"-d\tau^{-1}_{h\eta_{k+1}}(e_\gamma)(l_{x_{k+1}})+h(e_\gamma)_M(x_{k+1})(l_{\eta_{k+1}})=0$,"
    r" $x_{k+1}=x_k\tau(h\eta_k)$",
    how=ACTIONS,
)
def equations_in_velocities(s: Sample) -> Iterator[Claim]:
    g, h = (s.x, s.u), (s.y, s.w)
    yield same("x_{k+1}", s.b(*g), act(s, s.x, s.tau(s.h * s.u)))
    left = (s.R(*g) * adjoint(s, s.u)).T * s.d_u(*g)
    right = s.R(*h).T * s.d_u(*h)
    force = columns(s.m, lambda a: s.h * generator(s, s.y, a)).T * s.d_x(*h)
    wanted = [plus_by_curve(s, g, a) - minus_by_curve(s, h, a) for a in range(s.m)]
    yield same("left − right + force", left - right + force, wanted)


@checked(
    "3.7-remark",
    r"pair and group together: $\rho=(hI,0)$, $L$ and $R$ block-diagonal",
    how=SYMBOLIC,
)
def product_of_both() -> Iterator[Claim]:
    G = product(pair(1), lie_group(so(3)))
    x, u, h = (G.symbols[letter] for letter in "xuh")
    yield same("ρ", G.rho(x, h), Matrix([[h, 0, 0, 0]]))
    w = h * Rational(1, 2) * u[1:, :]
    for sign, found in ((1, G.L(x, u, h)), (-1, G.R(x, u, h))):
        block = eye(3) + sign * cross_matrix(w) + w * w.T
        yield same("blocks", found, Matrix.diag(1, block))


def exponential_of(matrix: Any) -> Any:
    """exp of a matrix of rationals, to 240 digits."""
    with mpmath.workdps(DIGITS):
        rows = [[mpmath.mpf(int(e.p)) / int(e.q) for e in row] for row in matrix.tolist()]
        found = mpmath.expm(mpmath.matrix(rows), method="taylor")
    return Matrix(*matrix.shape, [Rational(*map(int, to_rational(e._mpf_))) for e in found])


def cross_matrix(w: Any) -> Any:
    return Matrix([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def act(s: Sample, x: Any, g: Any) -> Any:
    """x·g: the rows of x times a matrix, or what a user says that it is."""
    if isinstance(s.g, UserAction):
        return s.g.moved(x, g)
    return (x.reshape(s.n // g.rows, g.rows) * g).reshape(s.n, 1)


def generator(s: Sample, x: Any, a: int) -> Any:
    """(e_γ)_M(x) = d/dt x·τ(t e_γ)."""
    return slope(lambda t: act(s, x, s.tau(t * s.e(a))))
