"""Sections 3.1 to 3.4: local coordinates, structure maps, invariant fields, the Lie algebroid."""

from __future__ import annotations

from collections.abc import Iterator

from sympy import Matrix, eye, zeros

from .numbers import columns, mixed_slope, slope
from .rows import CAYLEY, MATRIX, Claim, checked, definition, same
from .sample import Sample
from .section_2_groupoids import arrow


@checked(
    "3.1-Proposition 3.1",
    r"$W$ of all $g$ with positive $g+g^\ast$ in a matrix group, $M\times W$ in its actions, is a"
    r" symmetric neighborhood: $\epsilon(x)$ is in $W$;"
    r" $g^{-1}+g^{-\ast}=g^{-1}(g+g^\ast)g^{-\ast}$; and $g^{-1}(e+gk)=k+g^{-1}$, whose right side"
    r" has a positive real part: no eigenvalue of $gk$ is $-1$, nor negative, so that the charts of"
    r" both retractions hold it",
    how=MATRIX,
)
def symmetric_neighbourhood(s: Sample) -> Iterator[Claim]:
    g, k = s.tau(s.h * s.u), s.tau(s.h * s.v)
    back, both = s.tau(s.h * s.iota(s.x, s.u)), s.tau(s.h * s.p(s.x, s.u, s.v))
    e = eye(g.rows)
    yield same("ε(x)", s.tau(s.o) + s.tau(s.o).H, 2 * e)
    yield same("g⁻¹ with g", back + back.H, back * (g + g.H) * back.H)
    yield same("k + g⁻¹", back * (e + both), k + back)


@checked(
    "3.1-Cayley",
    r"there $W$ is $\Vert\xi\Vert_2=\Vert hu\Vert_2$ below 2, on $SO(3)$ less than a quarter turn:"
    r" $(e-\frac\xi2)^\ast(g+g^\ast)(e-\frac\xi2)=2(e-\frac14\xi^\ast\xi)$",
    how=CAYLEY,
)
def neighbourhood_in_the_chart(s: Sample) -> Iterator[Claim]:
    g, xi = s.tau(s.h * s.u), s.g.algebra.hat(s.h * s.u)
    e = eye(g.rows)
    near = e - xi / 2
    yield same("g + g*", near.H * (g + g.H) * near, 2 * e - xi.H * xi / 2)


definition("3.2-1", r"$(x,u)\cdot(y,v)=(x,p(x,u,v))$")


@checked("3.2-2", r"$b(b(x,u),v)=b(x,p(x,u,v))$")
def target_of_a_product(s: Sample) -> Iterator[Claim]:
    yield same("target", s.b(s.b(s.x, s.u), s.v), s.b(s.x, s.p(s.x, s.u, s.v)))


@checked("3.2-3", r"$p(x,u,0)=u$, $p(x,0,v)=v$; also $b(x,0)=x$")
def units(s: Sample) -> Iterator[Claim]:
    yield same("b(x, 0) = x", s.b(s.x, s.o), s.x)
    yield same("right unit", s.p(s.x, s.u, s.o), s.u)
    yield same("left unit", s.p(s.x, s.o, s.v), s.v)


@checked("3.2-4", r"$p(x,p(x,u,v),w)=p(x,u,p(y,v,w))$")
def associativity(s: Sample) -> Iterator[Claim]:
    left = s.p(s.x, s.p(s.x, s.u, s.v), s.w)
    yield same("associativity", left, s.p(s.x, s.u, s.p(s.b(s.x, s.u), s.v, s.w)))


@checked(
    "3.2-5",
    r"$\rho=\partial b/\partial u (x,0)$, $L=\partial p/\partial v (x,u,0)$,"
    r" $R=\partial p/\partial u (x,0,v)$ are the functions in use",
)
def rho_L_R(s: Sample) -> Iterator[Claim]:
    o, e = s.o, s.e
    rho = columns(s.m, lambda a: slope(lambda t: s.b(s.x, o + t * e(a))))
    L = columns(s.m, lambda a: slope(lambda t: s.p(s.x, s.u, t * e(a))))
    R = columns(s.m, lambda a: slope(lambda t: s.p(s.x, t * e(a), s.v)))
    yield same("ρ", rho, s.rho(s.x))
    yield same("L", L, s.L(s.x, s.u))
    yield same("R", R, s.R(s.x, s.v))


@checked(
    "3.2-6",
    r"$\partial p/\partial u=1$ and $\partial^2p/\partial u\partial u=0$ at $(x,u,0)$;"
    r" the same in $v$ at $(x,0,v)$",
)
def derivatives_of_p(s: Sample) -> Iterator[Claim]:
    def of_u(du: Matrix) -> Matrix:
        return s.p(s.x, s.u + du, s.o)

    def of_v(dv: Matrix) -> Matrix:
        return s.p(s.x, s.o, s.v + dv)

    for name, p in (("u", of_u), ("v", of_v)):
        first = columns(s.m, lambda a, p=p: slope(lambda t: p(t * s.e(a))))
        yield same(f"∂p/∂{name}", first, eye(s.m))
        for a in range(s.m):
            second = columns(
                s.m, lambda b, p=p, a=a: mixed_slope(lambda t, r: p(t * s.e(a) + r * s.e(b)))
            )
            yield same(f"∂²p/∂{name}∂{name}", second, zeros(s.m))


@checked(
    "3.2-7",
    r"$C^\gamma_{\mu\nu}=\partial^2p^\gamma/\partial u^\mu\partial v^\nu"
    r"-\partial^2p^\gamma/\partial v^\mu\partial u^\nu$ at $(x,0,0)$ are the functions in use",
)
def structure_functions(s: Sample) -> Iterator[Claim]:
    mixed = [
        [mixed_slope(lambda t, r, a=a, b=b: s.p(s.x, t * s.e(a), r * s.e(b))) for b in range(s.m)]
        for a in range(s.m)
    ]
    for c, wanted in enumerate(s.C(s.x)):
        yield same("C", Matrix(s.m, s.m, lambda a, b, c=c: mixed[a][b][c] - mixed[b][a][c]), wanted)


@checked(
    "3.2-8",
    r"$C^\gamma_{\mu\nu}=\partial L^\gamma_\nu/\partial u^\mu-\partial L^\gamma_\mu/\partial u^\nu"
    r"=\partial R^\gamma_\mu/\partial v^\nu-\partial R^\gamma_\nu/\partial v^\mu$ at $(x,0)$",
)
def structure_functions_of_L_and_R(s: Sample) -> Iterator[Claim]:
    dL = [slope(lambda t, a=a: s.L(s.x, t * s.e(a))) for a in range(s.m)]
    dR = [slope(lambda t, a=a: s.R(s.x, t * s.e(a))) for a in range(s.m)]
    for c, wanted in enumerate(s.C(s.x)):
        yield same("by L", Matrix(s.m, s.m, lambda a, b, c=c: dL[a][c, b] - dL[b][c, a]), wanted)
        yield same("by R", Matrix(s.m, s.m, lambda a, b, c=c: dR[b][c, a] - dR[a][c, b]), wanted)


@checked("3.2-9", r"$i(x,u)=(b(x,u),\iota(x,u))$ is an involution")
def involution(s: Sample) -> Iterator[Claim]:
    g = (s.x, s.u)
    yield same("i(i(g)) = g", arrow(s.inverse(s.inverse(g))), arrow(g))


@checked("3.2-10", r"$\iota(x,0)=0$")
def inverse_of_a_unit(s: Sample) -> Iterator[Claim]:
    yield same("ι(x, 0)", s.iota(s.x, s.o), s.o)


@checked(
    "3.2-11",
    r"$\partial p^\gamma/\partial u^\mu (x,u,\iota)"
    r"+\partial\iota^\nu/\partial u^\mu \partial p^\gamma/\partial v^\nu (x,u,\iota)=0$",
)
def derivative_of_p_at_the_inverse(s: Sample) -> Iterator[Claim]:
    w = s.iota(s.x, s.u)
    p_u = columns(s.m, lambda a: slope(lambda t: s.p(s.x, s.u + t * s.e(a), w)))
    p_v = columns(s.m, lambda a: slope(lambda t: s.p(s.x, s.u, w + t * s.e(a))))
    d_iota = columns(s.m, lambda a: slope(lambda t: s.iota(s.x, s.u + t * s.e(a))))
    yield same("p(x, u, ι) = 0", s.p(s.x, s.u, w), s.o)
    yield same("its derivative", p_u, -p_v * d_iota)


@checked("3.2-12", r"$\partial\iota^\gamma/\partial u^\mu (x,0)=-\delta^\gamma_\mu$")
def derivative_of_iota(s: Sample) -> Iterator[Claim]:
    found = columns(s.m, lambda a: slope(lambda t: s.iota(s.x, t * s.e(a))))
    yield same("∂ι/∂u", found, -eye(s.m))


@checked("3.3-1", r"$l_{(x_0,u_0)}(b(x_0,u_0),v)=(x_0,p(x_0,u_0,v))$")
def left_translation(s: Sample) -> Iterator[Claim]:
    y = s.b(s.x, s.u)
    moved = (s.x, s.p(s.x, s.u, s.v))
    yield same("it ends where the factor ends", s.b(*moved), s.b(y, s.v))
    back = s.times(s.inverse((s.x, s.u)), moved)
    yield same("and is undone by g⁻¹", arrow(back), arrow((y, s.v)))


@checked("3.3-2", r"$r_{(x_0,u_0)}(x,u)=(x,p(x,u,u_0))$ where $b(x,u)=x_0$")
def right_translation(s: Sample) -> Iterator[Claim]:
    h = (s.b(s.x, s.u), s.v)
    moved = (s.x, s.p(s.x, s.u, s.v))
    yield same("it ends where h₀ ends", s.b(*moved), s.b(*h))
    yield same("and is undone by h₀⁻¹", arrow(s.times(moved, s.inverse(h))), arrow((s.x, s.u)))


@checked(
    "3.3-3",
    r"$\overleftarrow{e_\gamma}=\partial p^\mu/\partial v^\gamma (x,u,0) \partial_{u^\mu}"
    r"=L^\mu_\gamma \partial_{u^\mu}$",
)
def left_fields(s: Sample) -> Iterator[Claim]:
    g = (s.x, s.u)
    by_l_g = columns(s.m, lambda a: slope(lambda t: arrow(s.pushed_left(g, a, t))))
    yield same("T l_g e_γ = L ∂/∂u", by_l_g, zeros(s.n, s.m).col_join(s.L(*g)))


@checked(
    "3.3-text",
    r"$f_\gamma=\rho^i_\gamma\partial_{x^i}-\partial_{u^\gamma}\in\ker T\beta$ at the identities,"
    r" $Ti(e_\gamma)=f_\gamma$",
)
def right_basis(s: Sample) -> Iterator[Claim]:
    f = s.rho(s.x).col_join(-eye(s.m))
    for a in range(s.m):
        dx, du = f[: s.n, a], f[s.n :, a]
        moved = slope(lambda t, dx=dx, du=du: s.b(s.x + t * dx, t * du))
        yield same("Tβ(f_γ) = 0", moved, zeros(s.n, 1))
        found = slope(lambda t, a=a: arrow(s.inverse(s.near_unit(s.x, a, t))))
        yield same("Ti(e_γ) = f_γ", found, f[:, a])


@checked(
    "3.3-4",
    r"$\overrightarrow{e_\gamma}=T r_g(-f_\gamma)=-\rho^i_\gamma \partial_{x^i}"
    r"+R^\mu_\gamma \partial_{u^\mu}$, since $\partial p/\partial x (x,0,u)=0$",
)
def right_fields(s: Sample) -> Iterator[Claim]:
    rho = s.rho(s.x)

    def translated(a: int) -> Matrix:
        """T r_g(−ρ ∂/∂x + ∂/∂u): r_g(x′, u′) = (x′, p(x′, u′, u))."""
        dx = -rho[:, a]
        return slope(lambda t: arrow((s.x + t * dx, s.p(s.x + t * dx, t * s.e(a), s.u))))

    p_x = columns(s.n, lambda i: slope(lambda t: s.p(s.x + t * eye(s.n)[:, i], s.o, s.u)))
    p_u = columns(s.m, lambda a: slope(lambda t: s.p(s.x, t * s.e(a), s.u)))
    found = columns(s.m, translated)
    inner = -p_x * rho + p_u if s.n else p_u
    yield same("second line", (-rho).col_join(inner), s.right(s.x, s.u))
    yield same("∂p/∂x (x, 0, u) = 0", p_x, zeros(*p_x.shape))
    yield same("third line", found, s.right(s.x, s.u))
    g = (s.x, s.u)
    by_curves = columns(s.m, lambda a: -slope(lambda t: arrow(s.pushed_right(g, a, t))))
    yield same("−T r_g Ti e_γ", found, by_curves)


@checked(
    "3.4-text",
    r"anchor $\rho(y^\gamma e_\gamma)=\rho^i_\gamma y^\gamma\partial_{x^i}$ and bracket"
    r" $C^\nu_{\gamma\mu}e_\nu$: the anchor is a morphism",
    "E-for-AG",
)
def algebroid(s: Sample) -> Iterator[Claim]:
    rho, C = s.rho(s.x), s.C(s.x)
    d_rho = [slope(lambda t, a=a: s.rho(s.x + t * rho[:, a])) for a in range(s.m)]
    for a in range(s.m):
        for b in range(s.m):
            lie = d_rho[a][:, b] - d_rho[b][:, a]
            bracket = Matrix(s.m, 1, [C[c][a, b] for c in range(s.m)])
            yield same("[ρ e_γ, ρ e_μ]", lie, rho * bracket)
