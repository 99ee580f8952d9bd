"""Section 4.1: bisections of a Lie groupoid and their translations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sympy import Matrix, Rational, symbols, zeros

from .bisections import Translations
from .numbers import columns, slope
from .rows import SYMBOLIC, Claim, broken, checked, definition, same
from .sample import Sample
from .section_2_groupoids import arrow
from .section_3_equations import newton


@checked(
    "4.1-1",
    r"$(\beta\circ\Sigma_\alpha)^{-1}=\alpha\circ\Sigma_\beta$, and the other way round",
    "alpha-without-bar",
)
def sections(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    y = s.y + Rational(1, 10**25) * Matrix(s.n, 1, [1 + k for k in range(s.n)])
    z = to.sigma_beta(y)[0]

    def in_sigma(w: Any) -> Any:
        """Zero where (z, w) lies in Σ: its inverse is (x, s(x))."""
        x, u = s.inverse((z, w))
        return u - s.iota(s.x, s.u) - to.slope * (x - s.y)

    w = newton(in_sigma, s.u)
    yield same("β(Σ_α(α(Σ_β(y)))) = y", s.b(z, w), y)
    yield same("Σ_α and Σ_β have one image", arrow((z, w)), arrow(to.sigma_beta(y)))


@checked(
    "4.1-Lemma 4.5",
    r"$A\oplus C=B\oplus C=V$: with bases $c,a$ of $A$ and $c,b$ of $B$, completed by $d$ to one of"
    r" $V$, $C=span(a+b,d)$ has $\det[c,a,a+b,d]=\det[c,a,b,d]=-\det[c,b,a+b,d]$;"
    r" checked where $c,a,b,d$ are one vector each, $4=1+1+1+1$",
    how=SYMBOLIC,
    spoilt=True,
)
def common_complement() -> Iterator[Claim]:
    c, a, b, d = (Matrix(4, 1, symbols(f"{letter}_0:4")) for letter in "cabd")
    whole = Matrix.hstack(c, a, b, d).det()
    yield same("A ⊕ C", Matrix.hstack(c, a, a + b, d).det(), whole)
    yield same("B ⊕ C", -Matrix.hstack(c, b, a + b, d).det(), whole)
    yield broken("A ⊕ C", Matrix.hstack(c, a, a, d).det(), whole)  # a alone is no complement


definition("4.1-2", r"$L_\Sigma(g)=hg$ with $h=\Sigma_\beta(\alpha(g))$")
definition("4.1-3", r"$R_\Sigma(g)=gh$ with $h=\Sigma_\alpha(\beta(g))$")


@checked(
    "4.1-text",
    r"$L_\Sigma$ keeps $\beta$-fibres, $R_\Sigma$ by the coordinates $\alpha$-fibres;"
    r" $L_\Sigma\circ l_g=l_{\Sigma\cdot g}$, $R_\Sigma\circ r_g=r_{g\cdot\Sigma}$",
    "preserves-alpha",
    "R-for-r",
)
def fibres(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    g, k = to.g_W, to.h_W
    yield same("β(Σ·g) = β(g)", s.b(*to.left(g)), s.b(*g))
    product = s.times(g, k)
    yield same("Σ·(gk) = (Σ·g)k", arrow(to.left(product)), arrow(s.times(to.left(g), k)))
    yield same("(gk)·Σ = g(k·Σ)", arrow(to.right(product)), arrow(s.times(g, to.right(k))))


@checked("4.1-4", r"$TL_\Sigma(\overleftarrow{X}(g))=\overleftarrow{X}(L_\Sigma g)$")
def left_fields_are_carried(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    x, u = to.g_W
    L = s.L(x, u)
    moved = columns(s.m, lambda a: slope(lambda t: arrow(to.left((x, u + t * L[:, a])))))
    yield same("TL_Σ", moved, s.left(*to.left((x, u))))


@checked("4.1-5", r"$TR_\Sigma(\overrightarrow{X}(g))=\overrightarrow{X}(R_\Sigma g)$")
def right_fields_are_carried(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    x, u = to.h_W
    rho, R = s.rho(x), s.R(x, u)

    def moved(a: int, t: Any) -> Any:
        return arrow(to.right((x - t * rho[:, a], u + t * R[:, a])))

    found = columns(s.m, lambda a: slope(lambda t: moved(a, t)))
    yield same("TR_Σ", found, s.right(*to.right((x, u))))


@checked(
    "4.1-Proposition 4.6",
    r"a local bisection passes through every arrow: here through $g$ and through $h$",
    "W-lower-beta",
)
def through_every_arrow(s: Sample) -> Iterator[Claim]:
    to = Translations(s)
    yield same("Σ_β(β(g)) = g", arrow(to.sigma_beta(s.y)), arrow((s.x, s.u)))
    yield same("L_Σ(ε(β(g))) = g", arrow(to.left((s.y, zeros(s.m, 1)))), arrow((s.x, s.u)))
    yield same("R_Υ(ε(α(h))) = h", arrow(to.right((s.y, zeros(s.m, 1)))), arrow((s.y, s.v)))
