"""Section 3.6.1: the pair groupoid, midpoint rule and Störmer–Verlet, with generic functions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sympy import Function, Matrix, Symbol, symbols, zeros

from discmech.integrators import Scene, Scheme, midpoint, pair, trapezoidal

from .rows import SYMBOLIC, Claim, checked, definition, same

G = pair(2)
h = Symbol("h", positive=True)
x, y, u, v, w = (Matrix(2, 1, symbols(f"{letter}_0:2", real=True)) for letter in "xyuvw")
M = Matrix(2, 2, [Symbol("M_0"), Symbol("M_1"), Symbol("M_1"), Symbol("M_2")])


def potential(at: Any) -> Any:
    """A generic function of the base."""
    return Function("V")(*at)


def force(at: Any) -> Any:
    """∂V/∂x at a point, 2×1."""
    return (
        Matrix([potential(x).diff(e) for e in x])
        .subs(dict(zip(x, at, strict=True)), simultaneous=True)
        .doit()
    )


def discrete(at: Any, velocity: Any) -> Any:
    """A generic discrete Lagrangian."""
    return Function("L_d")(*at, *velocity)


def gradient(f: Any, by: Any, at: Any, velocity: Any) -> Any:
    """∂f/∂x or ∂f/∂u (by = x or u) of f(x, u) at a point, 2×1."""
    slopes = Matrix([f(x, u).diff(e) for e in by])
    pairs = [*zip(x, at, strict=True), *zip(u, velocity, strict=True)]
    return slopes.subs(pairs, simultaneous=True).doit()


def by_fields(f: Any) -> Any:
    """e←(f)(x, u) − e→(f)(y, v) with y kept as a letter and the fields of the pair groupoid."""
    left, right = gradient(f, u, x, u), gradient(f, u, y, v) - h * gradient(f, x, y, v)
    return left - right


def at_target(expression: Any) -> Any:
    """The expression with y = x + hu."""
    return expression.subs(list(zip(y, x + h * u, strict=True)), simultaneous=True).doit()


@checked(
    "3.6.1-1", r"$\alpha,\beta,\epsilon,i,m$ of $M\times M$, in the coordinates below", how=SYMBOLIC
)
def structure() -> Iterator[Claim]:
    # (x₁, x₂) = (x, b(x, u)); the last point of a product is that of its second factor
    first, second = G.target(x, u, h), G.target(G.target(x, u, h), v, h)
    yield same("β", first, x + h * u)
    yield same("ε", G.target(x, zeros(2, 1), h), x)
    yield same("m", G.target(x, G.product(x, u, v, h), h), second)
    yield same("i", G.target(first, G.inversion(x, u, h), h), x)


definition("3.6.1-2", r"$u^i=(x^i(x_2)-x^i(x_1))/h$")


@checked("3.6.1-text", r"$b=x+hu$, $p=u+v$, $i(x,u)=(x+hu,-u)$", how=SYMBOLIC)
def local_maps() -> Iterator[Claim]:
    points = [x, x + h * u, x + h * u + h * v]
    yield same("p", (points[2] - points[0]) / h, G.product(x, u, v, h))
    yield same("ι", (points[0] - points[1]) / h, G.inversion(x, u, h))


@checked(
    "3.6.1-3",
    r"$\overleftarrow{\partial_{u^i}}=\partial_{u^i}$,"
    r" $\overrightarrow{\partial_{u^i}}=-h \partial_{x^i}+\partial_{u^i}$",
    how=SYMBOLIC,
)
def fields() -> Iterator[Claim]:
    one = Matrix.eye(2)
    yield same("left", G.derived["L"], one)
    yield same("right, along x", -G.derived["rho"].subs(G.symbols["h"], h), -h * one)
    yield same("right, along u", G.derived["R"], one)


@checked(
    "3.6.1-4",
    r"$\partial_{u}L_d(x,u)+h \partial_{x}L_d(y,v)-\partial_{u}L_d(y,v)=0$, $y=x+hu$",
    how=SYMBOLIC,
)
def equations() -> Iterator[Claim]:
    # L_d(x, u) = S(x, x + hu): the variation of S(x, y) + S(y, z) in y, times h
    def two_point(a: Any, b: Any) -> Any:
        return discrete(a, (b - a) / h)

    z = y + h * v
    total = two_point(x, w) + two_point(w, z)
    textbook = Matrix([total.diff(e) for e in w]).subs(list(zip(w, y, strict=True))).doit()
    found = at_target(by_fields(discrete))
    yield same("D₂S + D₁S", found, at_target(h * textbook))


@checked(
    "3.6.1-5",
    r"regular iff $h \partial_{x^i}\partial_{u^j}L_d-\partial_{u^i}\partial_{u^j}L_d$ is",
    how=SYMBOLIC,
)
def regularity() -> Iterator[Claim]:
    minus = gradient(discrete, u, x, u) - h * gradient(discrete, x, x, u)
    wanted = Matrix(
        2, 2, lambda i, j: h * discrete(x, u).diff(x[i], u[j]) - discrete(x, u).diff(u[i], u[j])
    )
    yield same("FL = −∂F⁻/∂u", -minus.jacobian(u), wanted)


definition("3.6.1-6", r"$L(x,\dot x)=\frac12\dot x^TM\dot x-V(x)$")
definition("3.6.1-7", r"$L_d=\frac h2u^TMu-hV(x+\frac h2u)$, the rule `midpoint`")


def by_midpoint(at: Any, velocity: Any) -> Any:
    """L_d of the midpoint example."""
    return h * (velocity.T * M * velocity)[0] / 2 - h * potential(at + h * velocity / 2)


def by_ends(at: Any, velocity: Any) -> Any:
    """L_d of the Störmer–Verlet example."""
    ends = potential(at) + potential(at + h * velocity)
    return h * (velocity.T * M * velocity)[0] / 2 - h * ends / 2


@checked(
    "3.6.1-8",
    r"$M\frac{v-u}h=-\frac12(V'(x+\frac h2u)+V'(y+\frac h2v))$: the implicit midpoint rule",
    how=SYMBOLIC,
)
def midpoint_rule() -> Iterator[Claim]:
    middle, next_middle = x + h * u / 2, y + h * v / 2
    printed_side = M * (v - u) / h + (force(middle) + force(next_middle)) / 2
    yield same("the equations", by_fields(by_midpoint), -(h**2) * printed_side)
    p_before = gradient(by_midpoint, u, x, u) - h * gradient(by_midpoint, x, x, u)
    p_after = gradient(by_midpoint, u, x, u)
    # ṗ = −V′, q̇ = M⁻¹p, both at the middle, with p = F/h
    yield same("p′ = p − hV′", (p_after - p_before) / h, -h * force(middle))
    yield same("q′ = q + hM⁻¹(p + p′)/2", (p_after + p_before) / (2 * h), M * u)
    yield same("the bench's", bench(midpoint), own(by_midpoint))


@checked(
    "3.6.1-9",
    r"$\frac h2(L(x,u)+L(x+hu,u))=\frac h2u^TMu-\frac h2(V(x)+V(x+hu))$, the rule `trapezoidal`",
    how=SYMBOLIC,
)
def mean_of_the_ends() -> Iterator[Claim]:
    def L(at: Any, velocity: Any) -> Any:
        return (velocity.T * M * velocity)[0] / 2 - potential(at)

    yield same("L_d", h * (L(x, u) + L(x + h * u, u)) / 2, by_ends(x, u))
    yield same("the bench's", bench(trapezoidal), own(by_ends))


@checked("3.6.1-10", r"$M\frac{v-u}h=-V'(y)$: Störmer–Verlet", how=SYMBOLIC)
def stoermer_verlet() -> Iterator[Claim]:
    printed_side = M * (v - u) / h + force(y)
    yield same("the equations", at_target(by_fields(by_ends)), at_target(-(h**2) * printed_side))
    # M (x₊ − 2x + x₋) = −h² V′(x) with x₊ = y + hv and x₋ = y − hu
    second_difference = (y + h * v) - 2 * y + (y - h * u)
    yield same("leapfrog", M * second_difference / h**2 + force(y), printed_side)


def bench(rule: Any) -> Any:
    """The residual that the bench derives for a potential of its own."""

    def lagrangian(at: Any, velocity: Any, p: Any) -> Any:
        return (velocity.T * p.mass * velocity)[0] / 2 - quartic(at)

    parameters = {"mass": [[2, 1], [1, 3]]}
    return Scheme(Scene("plane", G, lagrangian, parameters, x0=[0, 0], v0=[1, 0]), rule).residual


def own(L_d: Any) -> Any:
    """The same residual by the printed formulas, in the bench's letters."""
    own_mass = Matrix(2, 2, symbols("mass_0_0 mass_0_1 mass_1_0 mass_1_1", real=True))
    found = at_target(by_fields(L_d)).replace(Function("V"), lambda *at: quartic(at)).doit()
    # the bench's mass matrix need not be symmetric: its symmetric part acts
    mass = (own_mass + own_mass.T) / 2
    return found.subs([*zip(M, mass, strict=True), (h, G.symbols["h"])]).doit()


def quartic(at: Any) -> Any:
    """A potential without any symmetry."""
    return at[0] ** 2 * at[1] + at[1] ** 3 / 3 + at[0] ** 4
