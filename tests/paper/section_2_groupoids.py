"""Section 2.1: Lie groupoids, invariant fields, the Lie algebroid."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from .numbers import columns, slope
from .rows import Claim, checked, definition, same
from .sample import Sample

definition("2.1-1", r"$g$ is an arrow from $x=\alpha(g)$ to $y=\beta(g)$")
definition("2.1-2", r"composable pairs: $\beta(g)=\alpha(h)$")


@checked(
    "2.1-3",
    r"$\beta(gh)=\beta(h)$; $\alpha(gh)=\alpha(g)$ is built into the coordinates",
    "parenthesis",
)
def ends_of_a_product(s: Sample) -> Iterator[Claim]:
    g, h = (s.x, s.u), (s.y, s.v)
    yield same("β(gh) = β(h)", s.b(*s.times(g, h)), s.b(*h))


@checked("2.1-4", r"$g^{-1}$ goes from $y$ to $x$; $gg^{-1}$ and $g^{-1}g$ are units")
def inverse(s: Sample) -> Iterator[Claim]:
    g = (s.x, s.u)
    back = s.inverse(g)
    yield same("β(g⁻¹) = α(g)", s.b(*back), s.x)
    yield same("g g⁻¹ = ε(α(g))", s.times(g, back)[1], s.o)
    yield same("g⁻¹ g = ε(β(g))", s.times(back, g)[1], s.o)


@checked(
    "2.1-5", r"$l_g$ and $r_g$ map fibres to fibres; $l_g^{-1}=l_{g^{-1}}$, $r_g^{-1}=r_{g^{-1}}$"
)
def translations(s: Sample) -> Iterator[Claim]:
    g, h = (s.x, s.u), (s.y, s.v)
    yield same("r_h g ∈ β⁻¹(β(h))", s.b(*s.times(g, h)), s.b(*h))
    yield same("g⁻¹(gh) = h", s.times(s.inverse(g), s.times(g, h))[1], s.v)
    yield same("(gh)h⁻¹ = g", s.times(s.times(g, h), s.inverse(h))[1], s.u)


@checked("2.1-6", r"$\overleftarrow{X}(g)=T l_g X(\beta(g))$ is left-invariant")
def left_invariant(s: Sample) -> Iterator[Claim]:
    g = (s.x, s.u)
    found = columns(s.m, lambda a: slope(lambda t: arrow(s.pushed_left(g, a, t))))
    yield same("by curves", found, s.left(*g))
    gh = s.times(g, (s.y, s.v))
    L = s.L(s.y, s.v)
    moved = columns(s.m, lambda a: slope(lambda t: s.p(s.x, s.u, s.v + t * L[:, a])))
    yield same("X←(gh) = T l_g X←(h)", moved, s.L(*gh))


@checked("2.1-7", r"$\overrightarrow{X}(g)=-T r_g Ti X(\alpha(g))$ is right-invariant")
def right_invariant(s: Sample) -> Iterator[Claim]:
    g = (s.x, s.u)
    found = columns(s.m, lambda a: -slope(lambda t: arrow(s.pushed_right(g, a, t))))
    yield same("by curves", found, s.right(*g))
    gh = s.times(g, (s.y, s.v))
    field = s.right(*g)
    moved = columns(
        s.m, lambda a: s.along(lambda x, u: arrow(s.times((x, u), (s.y, s.v))), field[:, a])
    )
    yield same("X→(gh) = T r_h X→(g)", moved, s.right(*gh))


@checked(
    "2.1-8",
    r"$[\overleftarrow{e_\gamma},\overleftarrow{e_\mu}]"
    r"=(C^\nu_{\gamma\mu}\circ\beta) \overleftarrow{e_\nu}$; the anchor is $T\beta$",
)
def bracket_of_left_fields(s: Sample) -> Iterator[Claim]:
    brackets = lie_brackets(s, s.left, s.left)
    yield same("bracket", brackets, combined(s, s.C(s.y), s.left(s.x, s.u)))
    anchor = columns(s.m, lambda a: slope(lambda t: s.b(*s.near_unit(s.x, a, t))))
    yield same("anchor", anchor, s.rho(s.x))


@checked(
    "2.1-9",
    r"$[\overrightarrow{e_\gamma},\overrightarrow{e_\mu}]"
    r"=-(C^\nu_{\gamma\mu}\circ\alpha) \overrightarrow{e_\nu}$,"
    r" $[\overrightarrow{X},\overleftarrow{Y}]=0$",
)
def bracket_of_right_fields(s: Sample) -> Iterator[Claim]:
    brackets = lie_brackets(s, s.right, s.right)
    yield same("bracket", brackets, combined(s, [-c for c in s.C(s.x)], s.right(s.x, s.u)))
    mixed = lie_brackets(s, s.right, s.left)
    yield same("mixed bracket", mixed, [[0] * (s.n + s.m)] * s.m**2)


@checked(
    "2.1-10",
    r"$Ti\circ\overrightarrow{X}=-\overleftarrow{X}\circ i$,"
    r" $Ti\circ\overleftarrow{X}=-\overrightarrow{X}\circ i$",
)
def inversion_of_fields(s: Sample) -> Iterator[Claim]:
    g = (s.x, s.u)
    for name, field, other in (("right", s.right, s.left), ("left", s.left, s.right)):
        at = field(*g)
        moved = columns(
            s.m, lambda a, f=at: s.along(lambda x, u: arrow(s.inverse((x, u))), f[:, a])
        )
        yield same(name, moved, -other(*s.inverse(g)))


def arrow(g: tuple[Any, Any]) -> Any:
    """An arrow's coordinates as one column."""
    return g[0].col_join(g[1])


def lie_brackets(s: Sample, one: Any, other: Any) -> list[Any]:
    """[one_γ, other_μ] at (x, u) for all γ, μ, columns of length n + m."""
    ones, others = one(s.x, s.u), other(s.x, s.u)
    d_ones = [s.along(one, others[:, a]) for a in range(s.m)]
    d_others = d_ones if one == other else None
    d_others = [s.along(other, ones[:, a]) for a in range(s.m)] if d_others is None else d_others
    return [d_others[a][:, b] - d_ones[b][:, a] for a in range(s.m) for b in range(s.m)]


def combined(s: Sample, C: list[Any], fields: Any) -> list[Any]:
    """C^ν_{γμ} times the columns ν of fields, for all γ, μ."""
    zero = 0 * fields[:, 0]
    return [
        sum((C[c][a, b] * fields[:, c] for c in range(s.m)), zero)
        for a in range(s.m)
        for b in range(s.m)
    ]
