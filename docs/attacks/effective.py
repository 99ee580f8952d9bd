"""Rules that say what order they have once they are processed, sound and unsound ones."""

import sympy
from sympy import Rational as Q

from discmech import Scene, discretisation, one_step, pair

swing = Scene(
    name="heavy-swing", groupoid=pair(1), parameters={"m": 3},
    lagrangian=lambda x, v, p: p.m * v[0] ** 2 / 2 + sympy.cos(x[0]),
    x0=[1], v0=["0.3"], duration=20, step="1/10",
)  # fmt: skip
#: two bodies of unlike mass on springs that stiffen
two_bodies = Scene(
    name="two-bodies", groupoid=pair(2), parameters={"m": 2},
    lagrangian=lambda x, v, p: v[0] ** 2 / 2 + p.m * v[1] ** 2 / 2 + v[0] * v[1] / 4
    - x[0] ** 2 / 2 - x[1] ** 2 - (x[0] - x[1]) ** 4 / 4,
    x0=["0.5", "-0.2"], v0=["0.1", "0.3"], duration=20, step="1/10",
)  # fmt: skip


def gradients(L, G, x, u, h, factor, inverse):
    """Verlet with so much of h³ ∂V·M⁻¹∂V."""
    ends = (x, G.target(x, u, h))
    square = [(L.gradient(z).T * inverse(L.mass(z)) * L.gradient(z))[0] for z in ends]
    return h * (L(x, u) + L(ends[1], u)) / 2 + h**3 * factor * sum(square)


@discretisation(order=2, effective=4, groupoids="pair")
def takahashi_imada(L, G, x, u, h):
    """Takahashi and Imada 1984, Rowlands 1991."""
    return gradients(L, G, x, u, h, Q(1, 48), sympy.Matrix.inv)


@discretisation(order=2, effective=4, groupoids="pair")
def mass_forgotten(L, G, x, u, h):
    return gradients(L, G, x, u, h, Q(1, 48), lambda mass: sympy.eye(*mass.shape))


@discretisation(order=2, effective=4, groupoids="pair")
def diagonal_mass(L, G, x, u, h):
    return gradients(L, G, x, u, h, Q(1, 48), lambda mass: sympy.diag(*mass.diagonal()).inv())


@discretisation(order=2, effective=4, groupoids="pair")
def nearly(L, G, x, u, h):
    """Its factor is off by 10⁻⁸ of itself."""
    return gradients(L, G, x, u, h, Q(1, 48) * (1 + Q(1, 10**8)), sympy.Matrix.inv)


@discretisation(order=2, effective=4, groupoids="pair")
def wrong_sign(L, G, x, u, h):
    return gradients(L, G, x, u, h, -Q(1, 48), sympy.Matrix.inv)


@discretisation(order=2, effective=4)
def verlet(L, G, x, u, h):
    return h * (L(x, u) + L(G.target(x, u, h), u)) / 2


@discretisation(order=1, effective=2, groupoids="pair")
def one_end(L, G, x, u, h):
    """Symplectic Euler, which is Verlet but for a change of momentum by h/2 ∂V."""
    return h * L(x, u)


@discretisation(order=2, effective=5, groupoids="pair")
def beyond(L, G, x, u, h):
    return gradients(L, G, x, u, h, Q(1, 48), sympy.Matrix.inv)


@one_step(order=2, effective=4, groupoids="pair")
def as_map(s, z, h):
    """Takahashi and Imada's method as kicks and a drift: V − h²/24 ∂V·M⁻¹∂V in place of V."""
    x, mu = s.split(z)

    def kicked(x, mu):
        rest = s.join(x, 0 * mu)
        force = s.split(s.f(rest))[1]
        speed = s.split(s.f(s.join(x, force)))[0]
        return mu + h / 2 * (force + h**2 / 12 * s.df(rest)[len(x) :, : len(x)] * speed)

    mu = kicked(x, mu)
    x = x + h * s.split(s.f(s.join(x, mu)))[0]
    return s.join(x, kicked(x, mu))
