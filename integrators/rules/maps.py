"""One-step maps beside the variational rules: other integrators of the same equations.

Each is written in s.f, s.H, s.dH, s.B of `equations.DualSystem` and serves every groupoid, unless
it names those on which it exists.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache

from ..numbers import measure, sympy
from ..numbers.types import Column, Given, Letter
from .degenerate import degenerate_euler, degenerate_gauss, projected_gauss
from .galerkin import by_nodes, collocation_weight, node_value
from .one_step import DualSystem, OneStepMap, Staged, one_step

_HNW = "Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, II.1"
_HLW = "Hairer, Lubich, Wanner, Geometric Numerical Integration"
#: number of nodes of the average vector field if H is no polynomial
NODES = 6


@one_step(order=1, source=_HNW)
def explicit_euler(s: DualSystem, z: Column, h: Letter) -> Column:
    """One step along the vector field."""
    return z + h * s.f(z)


@one_step(order=2, source=_HNW)
def heun(s: DualSystem, z: Column, h: Letter) -> Column:
    """The explicit trapezoidal rule."""
    k = s.f(z)
    return z + h * (k + s.f(z + h * k)) / 2


@one_step(order=4, name="runge-kutta-4", source=_HNW)
def runge_kutta_4(s: DualSystem, z: Column, h: Letter) -> Column:
    """The classical Runge–Kutta method."""
    k1 = s.f(z)
    k2 = s.f(z + h * k1 / 2)
    k3 = s.f(z + h * k2 / 2)
    k4 = s.f(z + h * k3)
    return z + h * (k1 + 2 * k2 + 2 * k3 + k4) / 6


@one_step(order=2, implicit=True, source=f"{_HLW}, II.1.1")
def implicit_midpoint(s: DualSystem, z: Column, Z: Column, h: Letter) -> Column:
    """The field at the mean of both states: symplectic where the bracket is canonical."""
    return Z - z - h * s.f((z + Z) / 2)


@by_nodes("dual-gauss")
def dual_gauss(nodes: int) -> OneStepMap:
    """Return Gauss collocation of z on the dual, of order 2·nodes.

    One node is the implicit midpoint rule. It conserves quadratic first integrals, such as
    Casimirs, and is symplectic if the bracket is canonical. Raises `BadInput` for other than 1 to
    20 nodes.
    """

    @one_step(order=2 * nodes, stages=nodes, name=f"dual-gauss-{nodes}", source=f"{_HLW}, II.1.3")
    def collocation(s: DualSystem, z: Column, h: Letter, K: list[Column]) -> Staged:
        each = range(nodes)
        at = [z + h * sum((collocation_weight(s, nodes, i, j) * K[j] for j in each), 0 * z)
              for i in each]  # fmt: skip
        b = [node_value(s, "gauss", nodes, j, "b") for j in each]
        new = z + h * sum((b[j] * K[j] for j in each), 0 * z)
        return new, [K[i] - s.f(at[i]) for i in each]

    return collocation


@one_step(
    order=2, stages=1, name="stoermer-verlet", groupoids="pair", source=f"{_HLW}, I.1.4, VI.3"
)
def stoermer_verlet(s: DualSystem, z: Column, h: Letter, K: list[Column]) -> Staged:
    """Störmer–Verlet on T*Q, for any H(x, μ): the stage holds the slopes of x and of half μ."""
    (x, mu), (of_x, of_mu) = s.split(z), s.split(K[0])
    half, new = mu + h * of_mu / 2, x + h * of_x
    (speed, force), (end_speed, end_force) = (s.split(s.f(s.join(p, half))) for p in (x, new))
    residual = s.join(of_x - (speed + end_speed) / 2, of_mu - force)
    return s.join(new, half + h * end_force / 2), [residual]


def newmark(gamma: Given = "1/2", beta: Given = "1/4") -> OneStepMap:
    """Return Newmark's method with γ and β (exact numbers), of order 2 if γ = 1/2, else 1.

    With forces f in place of accelerations, the velocity that moves x belongs to the momentum μ +
    h((1/2 − β)f + βf′), averaged over both ends: for a constant mass matrix this is Newmark's own
    x′ = x + hv + h²((1/2 − β)a + βa′).
    """
    return _newmark(measure(gamma, "newmark: γ"), measure(beta, "newmark: β"))


@cache
def _newmark(g: Fraction, b: Fraction) -> OneStepMap:
    usual = (g, b) == (Fraction(1, 2), Fraction(1, 4))
    name = "newmark" if usual else f"newmark-{_decimal(g)}-{_decimal(b)}"

    @one_step(
        order=2 if 2 * g == 1 else 1, implicit=True, name=name, groupoids="pair",
        source="Kane, Marsden, Ortiz, West, Int. J. Numer. Meth. Engng. 49 (2000), 1295",
    )  # fmt: skip
    def method(s: DualSystem, z: Column, Z: Column, h: Letter) -> Column:
        gamma, beta = map(sympy.sympify, (g, b))
        (x, mu), (X, M) = s.split(z), s.split(Z)
        force, end_force = (s.split(s.f(at))[1] for at in (z, Z))
        mean = mu + h * ((1 - 2 * beta) * force / 2 + beta * end_force)
        speed = (s.split(s.f(s.join(x, mean)))[0] + s.split(s.f(s.join(X, mean)))[0]) / 2
        return s.join(X - x - h * speed, M - mu - h * ((1 - gamma) * force + gamma * end_force))

    method.formula.__doc__ = newmark.__doc__
    return method


def _decimal(value: Fraction) -> str:
    """Return the number as a part of a name: 0.3025, or 1_3 if decimals do not end."""
    text = f"{float(value):.12g}"
    return text if Fraction(text) == value else f"{value.numerator}_{value.denominator}"


@one_step(
    order=2,
    implicit=True,
    source="Cohen, Hairer, BIT 51 (2011), 91; Quispel, McLaren, J. Phys. A 41 (2008), 045206",
)
def average_vector_field(s: DualSystem, z: Column, Z: Column, h: Letter) -> Column:
    """B at the middle times the mean of dH along the straight step: energy is kept exactly.

    The mean is by Gauss quadrature: exact where H is a polynomial, else with 6 nodes.
    """
    nodes = NODES if s.degree is None else max(1, -(-s.degree // 2))
    mean = 0 * z
    for i in range(nodes):
        c, b = (node_value(s, "gauss", nodes, i, what) for what in "cb")
        mean += b * s.dH(z + c * (Z - z))
    middle = (z + Z) / 2
    return Z - z - h * (s.B(middle) * mean + s.force(middle))


@one_step(
    order=2, implicit=True, source="Gonzalez, J. Nonlinear Sci. 6 (1996), 449: the midpoint one"
)
def discrete_gradient(s: DualSystem, z: Column, Z: Column, h: Letter) -> Column:
    """B at the middle times a discrete gradient ∇̄H with ∇̄H·(Z − z) = H(Z) − H(z).

    It is singular at equilibria, where Z = z. A time in H is that of the middle.
    """
    middle = (z + Z) / 2
    clock = s.join(s.split(s.force(z))[0], 0 * s.split(z)[1])  # 1 where z holds the time
    start, end = (at + clock.multiply_elementwise(middle - at) for at in (z, Z))
    slope, moved = s.dH(middle), end - start
    missing = (s.H(end) - s.H(start) - slope.dot(moved)) / moved.dot(moved)
    return Z - z - h * (s.B(middle) * (slope + missing * moved) + s.force(middle))


@one_step(
    order=4,
    name="rkmk-4",
    groupoids=("lie_group", "action"),
    source=f"{_HLW}, IV.8; Munthe-Kaas, Appl. Numer. Math. 29 (1999), 115; "
    "Engø, Faltinsen, SIAM J. Numer. Anal. 39 (2001), 128: by the coadjoint action",
)
def rkmk_4(s: DualSystem, z: Column, h: Letter) -> Column:
    """The classical Runge–Kutta method for σ and p, where x·τ(σ) and Ad*_τ(σ) p are the state.

    On a group p is constant, and coadjoint orbits are kept. Beside a base p is moved by the force
    there, and orbits of the action are kept. τ is the groupoid's own retraction.
    """
    x, mu = s.split(z)
    clock = s.split(s.force(z))[0]  # how x moves beside the group: as time does

    def state(after: DualSystem, sigma: Column, p: Column) -> Column:
        return s.join(s.act(x, sigma) + after * clock, s.coadjoint(sigma, p))

    def force(at: Column) -> Column:
        return s.B(at)[s.n :, : s.n] * s.dH(at)[: s.n, :] + s.split(s.force(at))[1]

    along = [(s.xi(z), force(z))]
    for part in (h / 2, h / 2, h):
        of_sigma, of_p = along[-1]
        sigma = part * of_sigma
        at = state(part, sigma, mu + part * of_p)
        along.append((s.chart_velocity(sigma, s.xi(at)),
                      s.coadjoint(sigma, force(at), inverse=True)))  # fmt: skip
    (a1, b1), (a2, b2), (a3, b3), (a4, b4) = along
    sigma, p = h * (a1 + 2 * a2 + 2 * a3 + a4) / 6, mu + h * (b1 + 2 * b2 + 2 * b3 + b4) / 6
    return state(h, sigma, p)


#: in the order of `discmech list`: maps that conserve something first, then the explicit ones
MAPS = {m.name: m for m in (
    implicit_midpoint, dual_gauss(2), dual_gauss(3), stoermer_verlet, newmark(),
    average_vector_field, discrete_gradient, rkmk_4, explicit_euler, heun, runge_kutta_4,
    degenerate_euler, degenerate_gauss(1), degenerate_gauss(2), projected_gauss(1),
    projected_gauss(2), projected_gauss(1, "midpoint"), projected_gauss(1, "standard"),
)}  # fmt: skip


def whole(text: str) -> int | None:
    """Return the number in a rule's name, or None if there is none that a rule could have."""
    return int(text) if text.isdecimal() and len(text) < 5 else None


def map_of(name: str) -> OneStepMap | None:
    """Return the map of that name: of `MAPS`, a family with another N, newmark-γ-β; else None.

    Families are dual-gauss-N, degenerate-gauss-N and projected-gauss-N, with a -projection.
    """
    if name in MAPS:
        return MAPS[name]
    family, _, rest = name.partition("-gauss-")
    count, _, projection = rest.partition("-")
    if (nodes := whole(count)) is not None and family == "projected":
        return projected_gauss(nodes, projection or "symmetric")
    if (nodes := whole(rest)) is not None and family in ("dual", "degenerate"):
        return (dual_gauss if family == "dual" else degenerate_gauss)(nodes)
    parts = name.split("-")
    if parts[0] == "newmark" and len(parts) == 3:
        return newmark(*(part.replace("_", "/") for part in parts[1:]))
    return None
