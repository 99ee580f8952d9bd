"""Scenes and rules that the studies of energy and momentum once judged wrongly."""

import sympy

from discmech import Conserved, Scene, discretisation, one_step, pair


def swing(name, potential, **others):
    return Scene(
        name=name, groupoid=pair(1), lagrangian=lambda x, v, p: v[0] ** 2 / 2 - potential(x[0]),
        **{"x0": ["1/10"], "v0": [0], "duration": 10, "step": "1/2", **others},
    )  # fmt: skip


#: RK4 at this step brings them to rest, whatever constant stands in the potential
as_usual = swing("as-usual", lambda x: -sympy.cos(x))
offset = swing("offset", lambda x: 100 - sympy.cos(x))
quadratic_offset = swing("quadratic-offset", lambda x: x**2 / 2 + 1)

PLAIN = {"x0": [1], "step": "0.02"}
zero_force = swing("zero-force", lambda x: -sympy.cos(x), force=lambda x, v, p: [0], **PLAIN)
tiny_force = swing("tiny-force", lambda x: -sympy.cos(x),
                   force=lambda x, v, p: [-v[0] / 10**30], **PLAIN)  # fmt: skip
weak_force = swing("weak-force", lambda x: -sympy.cos(x),
                   force=lambda x, v, p: [-v[0] / 10**6], **PLAIN)  # fmt: skip
zero_time = Scene(
    name="zero-time", groupoid=pair(1), x0=[1], v0=[0], duration=10, step="0.02",
    lagrangian=lambda x, v, p, t: v[0] ** 2 / 2 + sympy.cos(x[0]),
)  # fmt: skip


@one_step(order=2, implicit=True)
def rubbed(s, z, Z, h):
    """The implicit midpoint rule with a friction of 10⁻¹² in a unit of time."""
    middle = (z + Z) / 2
    _, mu = s.split(middle)
    return Z - z - h * (s.f(middle) - s.join([0] * s.n, mu / 10**12))


#: a fast oscillator whose stiffness depends on a heavy slow coordinate, which the run sees move one
#: way only; and a pendulum seen from 10⁸ lengths away
slow = Scene(
    name="slow", groupoid=pair(2), parameters={"M": "1e10", "k": "1e-11"},
    lagrangian=lambda x, v, p: (v[0] ** 2 + p.M * v[1] ** 2 - (1 + x[1] ** 2 / 4) * x[0] ** 2
                                - p.M * p.k * x[1] ** 2) / 2,
    x0=[1, 0], v0=[0, "1e-5"], duration=50, step="0.05",
)  # fmt: skip
far = swing("far", lambda x: -sympy.cos(x - 10**8), x0=[10**8 + 1], step="0.02")
#: out of an unstable equilibrium, where it leaves by round-off
repulsive = swing("repulsive", lambda x: -(x**2) / 2, x0=[1], v0=[-1], step="0.05")


def quantity(name, formula):
    """A scene without a symmetry that claims to keep that quantity."""
    return Scene(
        name=name, groupoid=pair(2), symmetries=[Conserved(name, formula)],
        lagrangian=lambda x, v, p: v.dot(v) / 2 - x.dot(x) / 2 + x[0] ** 4 / 7,
        x0=[1, 0], v0=["0.3", 1], duration=10, step="0.05",
    )  # fmt: skip


def angular(x, m):
    return x[0] * m[1] - x[1] * m[0]


def one_of_squares(x):
    return sympy.sin(x) ** 2 + sympy.cos(x) ** 2


nothing = quantity("nothing", lambda x, m, p: 0 * m[0])
one = quantity("one", lambda x, m, p: m[0] / m[0])
squares = quantity("squares", lambda x, m, p: one_of_squares(x[0]))
hidden = quantity("hidden", lambda x, m, p: sympy.sin(10**14 * angular(x, m)))
tiny = quantity("tiny", lambda x, m, p: angular(x, m) + 10**16 * one_of_squares(x[0]))


def dragged(name, potential, x0, v0, duration):
    """A mass under drag that declares its angular momentum about the last axis."""
    return Scene(
        name=name, groupoid=pair(len(x0)), x0=x0, v0=v0, duration=duration, step="1/20",
        lagrangian=lambda x, v, p, t: (v.dot(v) - x.dot(x)) / 2 - potential(x, t),
        force=lambda x, v, p: -v / 20,
        symmetries=[Conserved("J", lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0])],
    )  # fmt: skip


in_a_plane = dragged("in-a-plane", lambda x, t: x[0] * x[2] ** 2, [1, "1/5", 0], ["1/5", 1, 0], 5)
gust = dragged("gust", lambda x, t: x[0] * sympy.exp(-((t - 30) ** 2)), [1, 0], ["1/5", 1], 40)


def pulled(name, sign):
    """The midpoint rule, with a force along x₀ at steps above, or below, 1/40."""

    @discretisation(order=2, name=name)
    def rule(L, G, x, u, h):
        side = 1 + sign * sympy.Abs(h - sympy.Rational(1, 40)) / (h - sympy.Rational(1, 40))
        return h * L(G.target(x, u, h / 2), u) + h**3 * x[0] / 100 * side

    return rule


pulled_long = pulled("pulled-long", 1)


#: a motion on an axis of an oval well, which has no angular momentum
axis = Scene(
    name="axis", groupoid=pair(2), x0=["0.8", 0], v0=["0.3", 0], duration=10, step="1/40",
    lagrangian=lambda x, v, p: v.dot(v) / 2 - x[0] ** 2 / 2 - x[1] ** 2 - x[0] ** 4 / 4,
    symmetries=[Conserved("L", lambda x, mu, p: angular(x, mu), kind="first integral")],
)  # fmt: skip


@one_step(order=2, implicit=True, symplectic=True)
def said_symplectic(s, z, Z, h):
    """A map whose form no study asks of a scene with a force."""
    return Z - z - h * s.f((z + Z) / 2)
