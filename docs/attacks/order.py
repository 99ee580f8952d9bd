"""Scenes and rules for the study of orders, unsound and sound: the second table of verdicts.md."""

import math
from fractions import Fraction

import numpy as np
import sympy
from sympy import Rational as Q

from discmech import Scene, discretisation, one_step, pair


def swing_like(name, start=(1, "0.3"), step="1/50", duration=10, **more):
    """A pendulum."""
    lagrangian = more.pop("lagrangian", lambda x, v, p: v[0] ** 2 / 2 + sympy.cos(x[0]))
    return Scene(
        name=name, groupoid=pair(1), lagrangian=lagrangian,
        x0=[start[0]], v0=[start[1]], duration=duration, step=step, **more,
    )  # fmt: skip


def spring(name, omega=1, start=(1, 0), **more):
    """A harmonic oscillator of that frequency."""
    return swing_like(
        name, start, parameters={"omega": omega},
        lagrangian=lambda x, v, p: v[0] ** 2 / 2 - p.omega**2 * x[0] ** 2 / 2, **more,
    )  # fmt: skip


# -- faults that one trajectory, t = 0 and steps h₀2ᵏ do not show ----------------------------------

driven = swing_like(
    "driven",
    lagrangian=lambda x, v, p, t: v[0] ** 2 / 2 + sympy.cos(x[0]) + x[0] * sympy.cos(2 * t) / 2,
)
at_64 = swing_like("at-64", step="1/64", duration=80)
planar = Scene(
    name="kepler-in-space", groupoid=pair(3),
    lagrangian=lambda x, v, p: v.dot(v) / 2 + 1 / sympy.sqrt(x.dot(x)),
    x0=["0.4", 0, 0], v0=[0, 2, 0], duration=10, step="0.01",
)  # fmt: skip


@discretisation(order=2)
def early_drive(L, G, x, u, h):
    """Midpoint in space; of the time 10⁻⁷ of the drive is taken at the start of the step."""
    middle = G.target(x, u, h / 2)
    early = sympy.Matrix([*middle[:-1, :], x[-1]])
    part = Q(1, 10**7)
    return h * ((1 - part) * L(middle, u) + part * L(early, u))


def kick(s, z, h):
    x, mu = s.split(z)
    return s.join(x, mu + h * s.split(s.f(z))[1])


def drift(s, z, h):
    x, mu = s.split(z)
    return s.join(x + h * s.split(s.f(z))[0], mu)


def verlet(s, z, h):
    """Störmer and Verlet."""
    return kick(s, drift(s, kick(s, z, h / 2), h), h / 2)


@one_step(order=2, groupoids="pair")
def cheat(s, z, h):
    """Verlet with a damping that is zero at the steps 2ᵏ/64."""
    x, mu = s.split(verlet(s, z, h))
    return s.join(x, mu * (1 - h * sympy.sin(sympy.pi * sympy.log(64 * h, 2)) ** 2))


@one_step(order=2, groupoids="pair")
def damped_off_plane(s, z, h):
    """Verlet with a damping of p_z by p_z² and z²."""
    x, mu = s.split(verlet(s, z, h))
    return s.join(x, mu - h * sympy.Matrix([0, 0, mu[2] ** 2 + x[2] ** 2]))


# -- inconsistent, or of a lower order, by little ------------------------------------------------


@discretisation(order=2)
def heavy(L, G, x, u, h):
    """V is too large by 10⁻¹⁰."""
    middle = G.target(x, u, h / 2)
    return h * L(middle, u) + h * L(middle, 0 * u) / 10**10


@discretisation(order=2)
def beside_the_middle(L, G, x, u, h):
    """The point of midpoint, moved by 10⁻⁶ of the step."""
    return h * L(G.target(x, u, (Q(1, 2) + Q(1, 10**6)) * h), u)


@discretisation()
def fast_clock(L, G, x, u, h):
    """ẋ = 1.1 p, ṗ = −1.1 V′, and no order is declared."""
    middle = G.target(x, u, h / 2)
    potential = -L(middle, 0 * u)
    return h * ((L(middle, u) + potential) / Q(11, 10) - Q(11, 10) * potential)


@discretisation()
def no_small_steps(L, G, x, u, h):
    """The same clock, of a rule that has no values at steps below 1/500."""
    middle = G.target(x, u, h / 2)
    kinetic = L(middle, u) - L(middle, 0 * u)
    return fast_clock.formula(L, G, x, u, h) + sympy.sqrt(h - Q(1, 500)) * kinetic / 10**40


@one_step(order=2, groupoids="pair")
def unit_mass(s, z, h):
    """Verlet that takes the momentum for the velocity."""
    x, p = s.split(z)
    half = p + h * s.split(s.f(z))[1] / 2
    new = x + h * half
    return s.join(new, half + h * s.split(s.f(s.join(new, half)))[1] / 2)


heavy_swing = swing_like(
    "heavy-swing", ("1.2", "0.1"), "1/20", 8,
    lagrangian=lambda x, v, p: v[0] ** 2 + sympy.cos(x[0]),
)  # fmt: skip


@discretisation(order=2)
def decoy(L, G, x, u, h):
    """Order 1 by an exact term; the float 0.1 stands in one of order h³ and is innocent."""
    middle = G.target(x, u, h / 2)
    potential = L(middle, 0 * u)
    return h * L(middle, u) + h**2 * potential / 10**8 + 0.1 * h**3 * potential


# -- sound ---------------------------------------------------------------------------------------

#: the unstable equilibrium but for the round-off of a double
at_the_top = swing_like("at-the-top", (math.pi, 0), "1/20", 20)
PERIOD = Fraction(62831853071795864769252867665590057683943387987502, 10**49)
forty_periods = spring("forty-periods", 1, (1, "0.3"), duration=40 * PERIOD, step=PERIOD / 64)
#: x = e^−t, v = −e^−t: on this motion the errors of x and v are alike
repulsive = swing_like(
    "repulsive", (1, -1), "1/20", lagrangian=lambda x, v, p: v[0] ** 2 / 2 + x[0] ** 2 / 2
)
linear_fall = swing_like(
    "linear-fall", (0, 1), "1/20", lagrangian=lambda x, v, p: v[0] ** 2 / 2 - x[0]
)
fast_spring = spring("fast-spring", 3000, duration=4, step="1/100")
long_spring = spring("long-spring", duration=40000, step="1/2")
swing = swing_like("swing", ("1.2", "0.1"), "1/20", 8)
plain_spring = spring("plain-spring", 1, ("1.2", "0.1"), step="1/20", duration=8)
tiny_beside = Scene(
    name="tiny-beside", groupoid=pair(2),
    lagrangian=lambda x, v, p: v.dot(v) / 2 + sympy.cos(x[0]) + sympy.cos(10**12 * x[1]) / 10**24,
    x0=[1, "1e-12"], v0=["0.2", 0], duration=10, step="1/20",
)  # fmt: skip


@one_step(order=2)
def nested(s, z, h):
    """z + h f(z + h/2 f(z + h/3 f(z + h/4 f(z)))): order 4 on linear fields, 2 on others."""
    new = z
    for k in (4, 3, 2, 1):
        new = z + h / k * s.f(new)
    return new


nested_four = one_step(order=4, name="nested-four")(nested.formula)
WEIGHTS = [1 / 6, 1 / 3, 1 / 3, 1 / 6]


@one_step(order=4)
def rk4_floats(s, z, h):
    """The classical Runge–Kutta method, its weights as floats."""
    k1 = s.f(z)
    k2 = s.f(z + h * k1 / 2)
    k3 = s.f(z + h * k2 / 2)
    k4 = s.f(z + h * k3)
    return z + h * sum((b * k for b, k in zip(WEIGHTS, (k1, k2, k3, k4), strict=True)), 0 * z)


NODES3, WEIGHTS3 = (e.tolist() for e in np.polynomial.legendre.leggauss(3))


@discretisation(order=2)
def three_points(L, G, x, u, h):
    """Points and weights that are symmetric, but for the rounding of 0.2, 0.3 and 0.8."""
    values = (b * L(G.target(x, u, c * h), u) for b, c in ((0.3, 0.2), (0.4, 0.5), (0.3, 0.8)))
    return h * sum(values, start=0)


@discretisation(order=2)
def three_nodes(L, G, x, u, h):
    """Gauss's three nodes of numpy on the straight step."""
    return sum(
        h * w / 2 * L(G.target(x, u, (1 + c) / 2 * h), u)
        for c, w in zip(NODES3, WEIGHTS3, strict=True)
    )


NODES2, WEIGHTS2 = (e.tolist() for e in np.polynomial.legendre.leggauss(2))


@discretisation(order=4, stages=1)
def galerkin_two(L, G, x, u, h, s):
    """A parabola and Gauss's two nodes of numpy."""
    total = 0
    for node, weight in zip(NODES2, WEIGHTS2, strict=True):
        t = (1 + node) / 2
        w = t * u + t * (1 - t) * s[0]
        velocity = G.velocity(x, w, u + (1 - 2 * t) * s[0], h)
        total += h * weight / 2 * L(G.target(x, w, h), velocity)
    return total


def lighter(L, u, h, added):
    """h L of a body whose inertia is 1/(1/I + added): H gains added |μ|²/2, a Casimir."""
    parts = zip(L.parameters.inertia, u, strict=True)
    return h * sum(e**2 / (1 / sympy.sympify(i) + added) for i, e in parts) / 2


@discretisation(order=2)
def body_fast(L, G, x, u, h):
    """The momentum of a body moves rightly, the body too fast."""
    return lighter(L, u, h, Q(1, 10))


@discretisation(order=2)
def body_first(L, G, x, u, h):
    """The same by a tenth of the step: the attitude is of order 1."""
    return lighter(L, u, h, h / 10)


@discretisation(order=2, groupoids="action")
def top_fast(L, G, x, u, h):
    """H gains 10⁻⁹ Γ·μ, a Casimir: (x, μ) move rightly, and the top turns too fast about Γ."""
    y = G.target(x, u, h / 2)
    return h * L(y, u - y / 10**9)


@one_step(order=2, groupoids="pair")
def damped_in_a_part(s, z, h):
    """Verlet that damps by 10⁻⁷ h where x is 0.3 to a thousandth, and nowhere else."""
    x, mu = s.split(verlet(s, z, h))
    part = ((s.split(z)[0][0] - Q(3, 10)) * 1000) ** 2
    return s.join(x, mu * (1 - h * sympy.exp(-part) / 10**7))


@discretisation(order=2)
def beside_in_a_part(L, G, x, u, h):
    """Midpoint, whose point is another where the last entry of x, or the time, is near to 0.3."""
    part = ((list(x)[-1] - Q(3, 10)) * 1000) ** 2
    return h * L(G.target(x, u, h * (5 + sympy.exp(-part)) / 10), u)


@one_step(order=2, groupoids="pair")
def bump(s, z, h):
    """Verlet with a kick of 10⁻⁸ h where the motion passes −0.7, and nowhere else."""
    x, mu = s.split(verlet(s, z, h))
    here = sympy.exp(-400 * (x[0] + Q(7, 10)) ** 2)
    return s.join(x, mu + h * sympy.Matrix([here / 10**8]))


def well(name, unit):
    """A Gaussian well, whose step is affine in no unit of length."""

    def lagrangian(x, v, p):
        return v[0] ** 2 / 2 + unit**2 * sympy.exp(-((x[0] / unit) ** 2))

    return Scene(name=name, groupoid=pair(1), lagrangian=lagrangian, x0=[unit], v0=[0], duration=10,
                 step="0.1")  # fmt: skip


small_well = well("small-well", sympy.Rational(1, 10**11))
