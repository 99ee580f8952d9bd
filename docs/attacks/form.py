"""Scenes and rules that the studies of form, adjoint and stability once judged wrongly."""

import sympy

from discmech import (
    MatrixAlgebra,
    Scene,
    action,
    discretisation,
    exponential,
    lie_group,
    one_step,
    pair,
    product,
    so,
)


@one_step(order=1, groupoids="pair", implicit=True, name="symplectic-euler")
def symplectic_euler(s, z, Z, h):
    """Symplectic: its slope has a zero where elimination fills and empties an entry."""
    (x, m), (X, M) = s.split(z), s.split(Z)
    a, b = s.split(s.f(s.join(X, m)))
    return s.join(X - x - h * a, M - m - h * b)


@one_step(order=2, symplectic=True, groupoids="pair")
def narrow(s, z, h):
    """Kick, drift, kick, which damps in a thousandth of the motion, by a power above its order."""
    x, m = s.split(z)
    m = m + h / 2 * s.split(s.f(z))[1]
    x = x + h * s.split(s.f(s.join(x, m)))[0]
    m = m + h / 2 * s.split(s.f(s.join(x, m)))[1]
    lost = h**3 / 10 * sympy.exp(-((4000 * (x[0] - sympy.Rational(7, 5))) ** 2))
    return s.join(x, m * (1 - lost))


@one_step()
def nothing(s, z, h):
    """The identity, which is its own adjoint."""
    return s.join(*s.split(z))


#: μ is constant: methods that are self-adjoint move nothing to and fro
ball = Scene(
    name="ball",
    groupoid=lie_group(so(3)),
    lagrangian=lambda x, v, p: v.dot(v) / 2,
    v0=["0.1", "0.2", "0.3"],
    duration=4,
    step="1/20",
)

#: 8e-3 of the pendulum is hidden behind a coordinate of 10⁹
two_parts = Scene(
    name="two-parts",
    groupoid=pair(2),
    lagrangian=lambda x, v, p: v[0] ** 2 / 2 + sympy.cos(x[0]) + v[1] ** 2 / 2,
    x0=[1, 0],
    v0=[0, 10**9],
    duration=10,
    step="0.02",
)

#: an algebra without a closed form of the exponential's functions
aff1 = Scene(
    name="aff1",
    groupoid=lie_group(MatrixAlgebra("aff1", (((1, 0), (0, 0)), ((0, 1), (0, 0)))), exponential),
    lagrangian=lambda x, v, p: (v[0] ** 2 + 2 * v[1] ** 2) / 2,
    v0=["0.3", "0.5"],
    duration=5,
    step="0.05",
)

#: a spring of ω = 1000 that nothing moves, beside one that moves
fast_at_rest = Scene(
    name="fast-at-rest",
    groupoid=pair(2),
    parameters={"omega": 1000},
    lagrangian=lambda x, v, p: v.dot(v) / 2 - x[0] ** 2 / 2 - p.omega**2 * x[1] ** 2 / 2,
    x0=[1, 0],
    v0=[0, 0],
    duration=6,
    step="0.01",
)


@discretisation(order=2, stages=1, splits=True, groupoids="pair")
def impulse(L, G, x, u, h, s):
    """Slow forces at both ends, two steps of Verlet for the fast one: resonates near hω = √8."""
    first, second = u + s[0], u - s[0]
    middle, end = x + h * first / 2, x + h * u
    verlet = L(x, first) + L(middle, first) + L(middle, second) + L(end, second)
    slow = [L(at, 0 * u) + L.fast(at) for at in (x, middle, end)]
    return h * verlet / 4 + h * (slow[0] + slow[2] - 2 * slow[1]) / 4


#: two pendulums, one of them with angles of 10⁻¹²
two_sizes = Scene(
    name="two-sizes",
    groupoid=pair(2),
    parameters={"a": "1e-12"},
    lagrangian=lambda x, v, p: (
        v[0] ** 2 / 2 + sympy.cos(x[0]) + v[1] ** 2 / 2 + p.a**2 * sympy.cos(x[1] / p.a)
    ),
    x0=[1, "1e-12"],
    v0=["0.2", 0],
    duration=10,
    step="0.05",
)


def told(x, v, p):
    """The pendulum in a unit of 10⁻⁶ of length, 10³ of time and 10⁻¹⁰ of mass."""
    return sympy.Rational(1, 10**28) * ((v[0] * 10**9) ** 2 / 2 + sympy.cos(10**6 * x[0]))


#: slopes of μ are 10⁻¹⁹ of those of x here, which once hid what Newton's method left of them
in_small_units = Scene(
    name="in-small-units", groupoid=pair(1), lagrangian=told, x0=["2e-6"], v0=[0],
    duration=10000, step=50,
)  # fmt: skip


#: a rotation by 0.3 about (1, 2, 2)/3, to the sixteen digits of doubles: it leaves SO(3) by 1e-16
ATTITUDE = [
    0.9602991014449831, -0.18708824646880545, 0.2069386957463139,
    0.2069386957463139, 0.9751869384031144, -0.07865628627627139,
    -0.18708824646880545, 0.11835718483128829, 0.9751869384031144,
]  # fmt: skip


def orbiting(x, v, p):
    """A body on an orbit, that its gravity turns: its place, and its axes seen from the stars."""
    r2 = sum(e**2 for e in x[:3])
    inertia = (sympy.Rational(6, 5), 1, sympy.Rational(3, 5))
    turned = [sum(x[3 + 3 * i + j] * x[i] for i in range(3)) for j in range(3)]
    gradient = sum(k * e**2 for k, e in zip(inertia, turned, strict=True)) / r2 ** sympy.Rational(
        5, 2
    )
    kinetic = (
        sum(e**2 for e in v[:3]) + sum(k * e**2 for k, e in zip(inertia, v[3:], strict=True)) / 100
    )
    return kinetic / 2 + 1 / sympy.sqrt(r2) - 3 * gradient / 200


#: nine numbers of the attitude stay on SO(3) to round-off alone
satellite = Scene(
    name="satellite", groupoid=product(pair(3), action(so(3), rows=3)), lagrangian=orbiting,
    x0=[1, 0, 0, *map(repr, ATTITUDE)], v0=[0, 1, "0.1", "0.2", "-0.3", "1.1"],
    duration=10, step="0.05",
)  # fmt: skip
