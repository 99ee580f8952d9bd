"""Section 3.7: the heavy top with the Cayley transform, component by component."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

from sympy import Matrix, diag, eye, symbols

from discmech.integrators import Scheme, cayley, rectangle, scenes, so

from .rows import SYMBOLIC, Claim, checked, definition, printed, same
from .section_3_so3 import E, as_printed, h, now, pair_with, then

inertia = symbols("I_1:4", positive=True)
mgd = symbols("mgd", positive=True)
e = Matrix(symbols("e_1:4", real=True))
Gamma, Gamma_next = (Matrix(3, 1, symbols(f"X_{k} Y_{k} Z_{k}", real=True)) for k in ("k", "l"))


def momentum(at: Any) -> Any:
    """∂L_c/∂Ω = IΩ."""
    return diag(*inertia) * at


def eta(at: Any) -> Any:
    """The matrix of Ω."""
    return Matrix([[0, -at[2], at[1]], [at[2], 0, -at[0]], [-at[1], at[0], 0]])


def in_paper_letters(expression: Any) -> Any:
    """What the bench derives for the scene heavy-top, in the letters of this file."""
    of = bench()
    p = of.s.parameters
    pairs = [*zip(p.inertia, inertia, strict=True), *zip(p.center, e, strict=True)]
    pairs += [(p.weight, mgd), (of.h, h)]
    pairs += [*zip(of.x, Gamma, strict=True), *zip(of.u, now, strict=True)]
    return expression.subs(pairs, simultaneous=True)


@lru_cache(maxsize=1)
def bench() -> Scheme:
    """The scene heavy-top with the paper's rule, L_d = h L_c."""
    return Scheme(scenes.get("heavy-top"), rectangle)


@lru_cache(maxsize=1)
def bench_equations() -> Any:
    """F⁺(Γ_k, Ω_k)/h − F⁻(Γ_{k+1}, Ω_{k+1})/h, with Γ_{k+1} as letters."""
    of = bench()
    plus, minus = (in_paper_letters(of.arrows.plus), in_paper_letters(of.arrows.minus))
    later = [*zip(Gamma, Gamma_next, strict=True), *zip(now, then, strict=True)]
    return (plus - minus.subs(later, simultaneous=True)) / h


@checked(
    "3.7-7",
    r"$L_c=\frac12\Omega\cdot I\Omega-mgd \Gamma\cdot e$, the scene `heavy-top`",
    how=SYMBOLIC,
)
def lagrangian() -> Iterator[Claim]:
    wanted = now.dot(momentum(now)) / 2 - mgd * Gamma.dot(e)
    yield same("L_c", in_paper_letters(bench().s.lagrangian), wanted)


@checked(
    "3.7-8",
    r"$\overleftarrow{C_{e_\gamma}}=(0,(e+\frac{h\eta}2)e_\gamma(e-\frac{h\eta}2))$,"
    r" $\overrightarrow{C_{e_\gamma}}="
    r"(-h\Gamma e_\gamma,(e-\frac{h\eta}2)e_\gamma(e+\frac{h\eta}2))$",
    "heavy-top-field",
    how=SYMBOLIC,
)
def fields() -> Iterator[Claim]:
    L, R = cayley.invariant_fields(so(3), h * now)
    G = scenes.get("heavy-top").groupoid
    a, one = h / 2 * eta(now), eye(3)
    for index, basis in enumerate(E):
        yield same("left", so(3).hat(L[:, index]), (one + a) * basis * (one - a))
        yield same("right, in η", so(3).hat(R[:, index]), (one - a) * basis * (one + a))
        # Γ moves along −d/dt Γ cay(t h e_γ), taken from the target map itself
        curve = G.target(Gamma, h * eye(3)[:, index] * (t := symbols("t")), 1)
        base = -curve.diff(t).subs(t, 0)
        yield same("right, in Γ", base, -h * (Gamma.T * basis).T)
        yield printed("heavy-top-field", base, h * (Gamma.T * basis).T)


definition("3.7-9", r"$\eta$, the matrix of $\Omega$ in the basis of $so(3)$", "basis-on-SO3")


@checked(
    "3.7-10",
    r"the equations with $+h \Gamma_{k+1}e_\gamma\cdot\partial L_c/\partial\Gamma$,"
    r" $\Gamma_{k+1}=\Gamma_k cay(h\eta_k)$",
    "l-for-L_d",
    how=SYMBOLIC,
)
def equations() -> Iterator[Claim]:
    a, b, one = h / 2 * eta(now), h / 2 * eta(then), eye(3)
    found = [
        pair_with((one + a) * basis * (one - a), momentum(now))
        - pair_with((one - b) * basis * (one + b), momentum(then))
        + h * (Gamma_next.T * basis * (-mgd * e))[0]
        for basis in E
    ]
    yield same("the bench's", list(bench_equations()), found)
    target = in_paper_letters(bench().scene.groupoid.target(bench().x, bench().u, bench().h))
    yield same("Γ_{k+1}", target, ((one - a).inv() * (one + a)).T * Gamma)


def component(index: int, power: int, torque_sign: int) -> Any:
    """An equation of the paper; as printed it has power 1 and torque sign +1."""
    terms = as_printed(now, momentum(now), then, momentum(then), power)
    (X, Y, Z), (e1, e2, e3) = Gamma_next, e
    torque = (Z * e2 - Y * e3, X * e3 - Z * e1, -(X * e2 - Y * e1))
    return terms[index] + torque_sign * h * mgd * torque[index]


def check_component(index: int) -> Iterator[Claim]:
    """The bench's equation, its mended form and its printed one [misprint: heavy-top-torque]."""
    found = bench_equations()[index]
    yield same("mended", found, component(index, 2, -1))
    yield printed("heavy-top-torque", found, component(index, 2, 1))
    # the printed torque is what the printed field [misprint: heavy-top-field] leads to
    force = (Gamma_next.T * E[index] * (-mgd * e))[0]
    yield same("its consequence", found - 2 * h * force, component(index, 2, 1))


@checked(
    "3.7-11",
    r"first component, with the torque $-hmgd(Z_{k+1}e_2-Y_{k+1}e_3)$",
    "heavy-top-torque",
    how=SYMBOLIC,
)
def first() -> Iterator[Claim]:
    yield from check_component(0)


@checked(
    "3.7-12",
    r"second component, with the torque $-hmgd(X_{k+1}e_3-Z_{k+1}e_1)$",
    "heavy-top-torque",
    "dangling-plus",
    how=SYMBOLIC,
)
def second() -> Iterator[Claim]:
    yield from check_component(1)


@checked(
    "3.7-13",
    r"third component, with $1+\frac{h^2\Omega_3^2}4$ and the torque"
    r" $+hmgd(X_{k+1}e_2-Y_{k+1}e_1)$; $\Gamma_{k+1}=\Gamma_k(e-\frac{h\eta_k}2)^{-1}"
    r"(e+\frac{h\eta_k}2)$",
    "heavy-top-torque",
    "so3-square",
    how=SYMBOLIC,
)
def third() -> Iterator[Claim]:
    yield from check_component(2)
    yield printed("so3-square", bench_equations()[2], component(2, 1, -1))
    a, one = h / 2 * eta(now), eye(3)
    of = bench()
    found = in_paper_letters(of.scene.groupoid.target(of.x, of.u, of.h))
    yield same("Γ_{k+1}", found.T, Gamma.T * (one - a).inv() * (one + a))


definition("3.7-14", r"$\eta_k$, and $\Gamma_k=(X_k,Y_k,Z_k)$ with $\Gamma_k\cdot\Gamma_k=1$")
