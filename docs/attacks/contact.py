"""Scenes of contact that were once run or judged wrongly, each with what is right."""

import sympy
from sympy import Rational as Q

from discmech import Conserved, Scene, discretisation, one_step, pair


def flat(x, v, p):
    """A free mass of 1 in a gravity of 1 along −x₁."""
    return v.dot(v) / 2 - x[1]


def free(x, v, p):
    return v.dot(v) / 2


def thin(name, n, gap, step="0.03"):
    """A mass that flies at 1 towards something thinner than a step, at x₀ = 1: it turns back."""
    return Scene(
        name=name, groupoid=pair(n), lagrangian=free, contact=lambda x, p: [gap(x)], restitution=1,
        x0=[0] * n, v0=[1] + [0] * (n - 1), duration=4, step=step,
    )  # fmt: skip


def table(name, gap, **more):
    """A block that slides on a table with friction 1/2, from x₀ = 0 at 1: it stops at x₀ = 1."""
    given = {"friction": "1/2", "restitution": 0, "x0": [0, 0], "v0": [1, 0], "duration": 3,
             "step": "0.02", **more}  # fmt: skip
    return Scene(name=name, groupoid=pair(2), lagrangian=flat, contact=lambda x, p: gap(x), **given)


post = thin("post", 2, lambda x: sympy.sqrt((x[0] - 1) ** 2 + x[1] ** 2) - Q(1, 10000))
#: a mass flies through the centre of a ring, where the distance from it has no slope
ring = thin("ring", 2, lambda x: 1 - sympy.sqrt((x[0] - 1) ** 2 + x[1] ** 2), step="1/4")
#: round-off of x turns its normal by 1e-11
needle = thin(
    "needle", 2, step="0.037",
    gap=lambda x: sympy.sqrt((x[0] - Q(7, 5)) ** 2 + (x[1] - Q(1, 10**6)) ** 2) - Q(1, 10**5),
)  # fmt: skip
#: a post of 10⁻⁵ at x₀ = 100, as squares of lengths and with the squares multiplied out
squares, expanded = (
    thin(name, 2, lambda x, e=e: e((x[0] - 100) ** 2 + x[1] ** 2 - Q(1, 10**10)), "0.047")
    .with_values(v0=[100, 0])
    for name, e in (("squares", sympy.sympify), ("expanded", sympy.expand))
)  # fmt: skip
wall = thin("wall", 1, lambda x: (x[0] - 1) ** 2 - Q(1, 10**6))
spike = thin("spike", 1, lambda x: 1 - 2 / (1 + (1000 * (x[0] - 1)) ** 2))

#: falls between a floor and a peg of a thousandth, which it meets at t = 0.7: no friction anywhere
pegs = Scene(
    name="pegs", groupoid=pair(2), lagrangian=flat, restitution="0.9", duration=4, step="0.02",
    contact=lambda x, p: [
        x[1] + 1, sympy.sqrt((x[0] - Q(1, 2)) ** 2 + (x[1] + Q(1, 4)) ** 2) - Q(1, 1000)
    ],
    x0=[0, 0], v0=["0.7071067811865475", 0],
)  # fmt: skip

#: stops at x₀ = 1, whatever the gap's unit; once it was flung to 1e74
blown = table("blown", lambda x: [3 * x[1]], step="0.01", impacts="located")
#: φ is no distance beside the coordinate of the touching point: friction is a third of what it says
scaled = table("scaled", lambda x: [(3 * x[1], [x[0]])])
unscaled = table("unscaled", lambda x: [(3 * x[1], [3 * x[0]])])
#: nothing ever touches: there is nothing to judge
nothing = table("nothing", lambda x: [x[1] + 1000], friction=0, restitution=1)
never_down = Scene(
    name="never-down", groupoid=pair(1), lagrangian=free, contact=lambda x, p: [x[0]],
    restitution=1, x0=[1], v0=[1], duration=3, step="0.02",
)  # fmt: skip
#: comes to rest at the end of a step; once it ran for minutes and was refused
hang_ball = table("hang-ball", lambda x: [x[1]], friction=0, restitution="1/2",
                  x0=["-0.08", "0.6"], v0=["0.75", "0.1"], duration=4)  # fmt: skip
#: its first impact is on a row of the run, whose gap is open by round-off
on_a_row = table("on-a-row", lambda x: [x[1]], friction="0.1", restitution="1/3",
                 x0=[0, "0.5"], v0=[1, 0], duration=4)  # fmt: skip


def rolling(inertia, friction="1/2", **more):
    """A disc (inertia 1/2) or sphere (2/5) on a 3:4 slope, or the flat: rolls at tan α below κ."""
    given = {"x0": [0, 0, 0], "v0": [0, 0, 0], "slope": (Q(3, 5), Q(4, 5)), **more}
    s, c = given.pop("slope")
    return Scene(
        name="roll", groupoid=pair(3), parameters={"J": inertia},
        lagrangian=lambda x, v, p:
            (v[0] ** 2 + v[1] ** 2 + p.J * v[2] ** 2) / 2 + s * x[0] - c * x[1],
        contact=lambda x, p: [(x[1], [x[0] + x[2]])], friction=friction, **given,
    )  # fmt: skip


#: slides on a table in space, askew to its axes, and stops after v²/2κ
puck = Scene(
    name="puck", groupoid=pair(3), lagrangian=lambda x, v, p: v.dot(v) / 2 - x[2],
    contact=lambda x, p: [x[2]], friction="0.3", impacts="located", x0=[0, 0, 0],
    v0=["0.6", "0.8", 0], duration=5,
)  # fmt: skip


def rod(friction, **more):
    """Painlevé's rod at tan θ = 2, whose lower end slides at −1: from κ = 4/3 on no sliding has a
    pressure, and the end sticks by the impulse (0.3, 0.4), whatever the step."""
    return Scene(
        name="rod", groupoid=pair(3),
        lagrangian=lambda x, v, p: (v[0] ** 2 + v[1] ** 2 + v[2] ** 2 / 3) / 2 - x[1],
        contact=lambda x, p: [(x[1] - sympy.sin(x[2]), [x[0] - sympy.cos(x[2])])],
        friction=friction, x0=[0, 2 / 5**0.5, float(sympy.atan(2))], v0=[-1, 0, 0], **more,
    )  # fmt: skip


def quick(L, G, x, u, h):
    """The midpoint rule with a clock 10 % fast: forms, momenta and energy are as they should be."""
    m, fast = G.target(x, u, h / 2), Q(11, 10)
    potential = -L(m, 0 * u)
    return h * ((L(m, u) + potential) / fast - fast * potential)


@discretisation(order=2)
def fast_clock(L, G, x, u, h):
    return quick(L, G, x, u, h)


@discretisation()
def fast_clock_unsaid(L, G, x, u, h):
    return quick(L, G, x, u, h)


def ball(name, length, mass):
    """A ball in a valley over a floor, in another unit of length and of mass."""
    return Scene(
        name=name, groupoid=pair(2), friction="3/10", restitution="1/2", duration=4, step="1/50",
        lagrangian=lambda x, v, p:
            mass * (v.dot(v) / 2 - length * x[1] - x[0] ** 2 / 8),
        contact=lambda x, p: [x[1]], x0=[0, length], v0=[length / 3, 0],
    )  # fmt: skip


tiny_ball, light_ball = ball("tiny-ball", Q(1, 10**100), 1), ball("light-ball", Q(1), Q(1, 10**150))


def steep(x, v, p):
    """A mass above a table at 0, which falls to −∞ where the table is not there."""
    return v.dot(v) / 2 - x[0] - x[0] ** 3 / 6


falling = Scene(
    name="falling", groupoid=pair(1), lagrangian=steep, contact=lambda x, p: [x[0]],
    restitution="9/10", x0=[1], v0=[0], duration=6, step="1/30",
)  # fmt: skip


@discretisation(order=2)
def in_the_middle(L, G, x, u, h):
    """Of order 1 in a sixtieth of the way of the mass: θ is 1/2 + 10⁻³ there."""
    part = sympy.exp(-(((x[0] - Q(62, 100)) * 60) ** 2))
    return h * L(G.target(x, u, (Q(1, 2) + part / 10**3) * h), u)


#: a mass on a spring inside a round wall about the origin, whose symmetry both have; and one beside
#: a plane wall, which has it not
inside = Scene(
    name="inside", groupoid=pair(2), lagrangian=lambda x, v, p: (v.dot(v) - x.dot(x)) / 2,
    contact=lambda x, p: [1 - sympy.sqrt(x.dot(x))], restitution=1, impacts="located",
    x0=["0.3", "0.1"], v0=["0.7", "1.1"], duration=6, step="1/20",
    symmetries=[Conserved("turns", lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0])],
)  # fmt: skip
beside = inside.with_values(name="beside", contact=lambda x, p: [x[0] + x[1] / 5 + Q(1, 2)])
#: the spring is stiffer along x₀ by 10⁻⁶: no symmetry
oval = inside.with_values(
    name="oval", lagrangian=lambda x, v, p: (v.dot(v) - x.dot(x) - x[0] ** 2 / 10**6) / 2
)


@discretisation(order=2)
def aside(L, G, x, u, h):
    """The midpoint rule with a pull along x₀ of 10⁻⁶ h²."""
    return h * L(G.target(x, u, h / 2), u) + h**3 * x[0] ** 2 / 10**6


@one_step(order=2, implicit=True, reversible=True)
def one_way(s, z, Z, h):
    """The implicit midpoint rule with a kick of 10⁻⁶ h⁴: no step back undoes a step."""
    kick = [s.split(z + Z)[0][0] / 10**6] + [0] * (s.n - 1)
    return Z - z - h * s.f((z + Z) / 2) - h**4 * s.join([0] * s.n, kick)


@one_step(order=2, implicit=True, reversible=True)
def there_and_back(s, z, Z, h):
    return Z - z - h * s.f((z + Z) / 2)


@one_step(order=2, keeps="energy")
def of_no_energy(s, z, h):
    """Heun's method."""
    f = s.f(z)
    return z + h * (f + s.f(z + h * f)) / 2


@one_step(order=2, keeps="turns")
def of_no_form(s, z, h):
    """The same, of which no form is claimed."""
    f = s.f(z)
    return z + h * (f + s.f(z + h * f)) / 2
