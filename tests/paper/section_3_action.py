"""Section 3.7: action groupoids."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from sympy import Matrix, Rational, eye, zeros

from discmech.integrators import LocalGroupoid
from discmech.integrators.groupoids.action import UserAction

from .curves import minus_by_curve, plus_by_curve
from .numbers import columns, slope
from .rows import ACTIONS, SYMBOLIC, Claim, checked, printed, same
from .sample import Sample
from .section_2_groupoids import arrow
from .section_3_group import adjoint


@checked(
    "3.7-1",
    r"$\alpha(x,g)=x$, $\beta(x,g)=xg$, $m=(x,gg')$, $i(x,g)=(xg,g^{-1})$",
    ACTIONS,
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
    ACTIONS,
)
def fields_of_constant_sections(s: Sample) -> Iterator[Claim]:
    g, h = s.tau(s.h * s.u), (s.x, s.u)
    for a in range(s.m):
        # η is h times the basis element: the section ∂/∂u^γ
        eta = s.g.algebra.hat(s.h * s.e(a))
        left = slope(lambda t, a=a: arrow(s.pushed_left(h, a, t)))
        right = -slope(lambda t, a=a: arrow(s.pushed_right(h, a, t)))
        yield same("0", left[: s.n, :], zeros(s.n, 1))
        yield same("−η_M", right[: s.n, :], -s.h * generator(s, s.x, a))
        for field, wanted in ((left, g * eta), (right, eta * g)):
            du = field[s.n :, :]
            moved = slope(lambda t, du=du: s.tau(s.h * (s.u + t * du)))
            yield same("η← and η→", moved, wanted)


@checked(
    "3.7-3",
    r"$\overleftarrow{C_\eta}(x_k,g_k)(L_d)-\overrightarrow{C_\eta}(x_kg_k,g_{k+1})(L_d)=0$",
    ACTIONS,
    "L-for-L_d",
    free=("τ",),  # only the L of the printed form reads it
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
    r"$\Phi_{\xi_M}(t,x)=x\exp(t\xi)$, the flow of $\xi_M$; the step stands before $(e_\gamma)_M$",
    ACTIONS,
    "flow-step",
)
def fundamental_fields(s: Sample) -> Iterator[Claim]:
    for a in range(s.m):
        moved = -slope(lambda t, a=a: s.b(*s.near_unit(s.x, a, t)))
        from_flow = slope(lambda t, a=a: act(s, s.x, s.tau(t * s.e(a))))
        with_step = slope(lambda t, a=a: act(s, s.x, s.tau(t * s.h * s.e(a))))
        yield same("−h(e_γ)_M", moved, -s.h * from_flow)  # [misprint: flow-step]
        yield printed("flow-step", moved, -s.h * with_step)


@checked(
    "3.7-5",
    r"$\overleftarrow{C_{e_\gamma}}=(0,d\tau^{-1}_{h\eta}(Ad_{\tau(h\eta)}e_\gamma))$,"
    r" $\overrightarrow{C_{e_\gamma}}=(-h(e_\gamma)_M,d\tau^{-1}_{h\eta}(e_\gamma))$",
    ACTIONS,
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
    ACTIONS,
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
    SYMBOLIC,
)
def product_of_both() -> Iterator[Claim]:
    from tests.objects import compose

    def point(z: Any) -> tuple[Any, Any]:
        return z[:1, :], z[1:, :]

    G = LocalGroupoid(
        1,
        4,
        target=lambda x, u, h: [x[0] + h * u[0]],
        product=lambda x, u, v, h: [u[0] + v[0], *compose(u[1:, :], v[1:, :], h)],
        name="pair × so(3)",
    )
    s = G.symbols
    x, u, h = s["x"], s["u"], s["h"]
    yield same("ρ", G.rho(x, h), Matrix([[h, 0, 0, 0]]))
    w = h * Rational(1, 2) * point(u)[1]
    for sign, found in ((1, G.L(x, u, h)), (-1, G.R(x, u, h))):
        block = eye(3) + sign * cross_matrix(w) + w * w.T
        yield same("blocks", found, Matrix.diag(1, block))


def cross_matrix(w: Any) -> Any:
    """The matrix of w×."""
    return Matrix([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])


def act(s: Sample, x: Any, g: Any) -> Any:
    """x·g: the rows of x times a matrix, or what a user says that it is."""
    if isinstance(s.g, UserAction):
        return s.g.moved(x, g)
    return (x.reshape(s.n // g.rows, g.rows) * g).reshape(s.n, 1)


def generator(s: Sample, x: Any, a: int) -> Any:
    """(e_γ)_M(x) = d/dt x·τ(t e_γ)."""
    return slope(lambda t: act(s, x, s.tau(t * s.e(a))))
