"""Inputs of `discmech lattices` that once had a wrong verdict; docs/verdicts.md says which."""

from dataclasses import replace

import numpy as np
import sympy
from sympy import Rational

from discmech import Lattice, discretisation, lie_group, pair, product, so

START = (0.3 + 0.2 * np.sin(np.arange(12)))[:, None]


def string(name, gap):
    """Beads on a string; their obstacle lies at that height."""
    return Lattice(
        name=name, site=pair(1), sites=12, parameters={"stiffness": 4, "gravity": 1},
        on_site=lambda x, v, p: v[0] ** 2 / 2 - p.gravity * x[0],
        on_bond=lambda x, y, p: -p.stiffness * (y[0] - x[0]) ** 2 / 2,
        contact=lambda x, p: [x[0] - gap], restitution="1/2", x0=START, v0=0 * START, step="1/50",
    )  # fmt: skip


table, far_table = string("table", 0), string("far-table", -100)
#: the table under a drive, which does work on the beads
pushed = replace(table, name="pushed", force=lambda x, v, p, t: [3 * sympy.sin(2 * t)])


@discretisation(order=4)
def third(L, G, x, u, h):
    """A rule of order 1 that is said to be of order 4."""
    return h * L(G.target(x, u, h / 3), u)


@discretisation(order=2)
def beside_the_middle(L, G, x, u, h):
    """The point of midpoint moved by 10⁻⁶ of the step: of order 1."""
    return h * L(G.target(x, u, (Rational(1, 2) + Rational(1, 10**6)) * h), u)


@discretisation(order=2)
def beside_on_sites(L, G, x, u, h):
    """The same where it is asked for a site, and midpoint where it is asked for a bond."""
    off = Rational(1, 10**6) if len(x) == 1 else 0
    return h * L(G.target(x, u, (Rational(1, 2) + off) * h), u)


@discretisation(order=2)
def first_bead(L, G, x, u, h):
    """Of order 1 about x = 0, where the first one of beads in a row moves."""
    off = sum(sympy.exp(-((4 * z) ** 2)) for z in x) / 10**4
    return h * L(G.target(x, u, (Rational(1, 2) + off) * h), u)


@discretisation(order=2)
def late(L, G, x, u, h):
    """Of order 1 about t = 5.3, in a five hundredth of the motion."""
    off = sympy.exp(-((100 * x[-1] - 530) ** 2)) / 100
    return h * L(G.target(x, u, (Rational(1, 2) + off) * h), u)


#: beads at rest at 0, 1, 2, …
row = Lattice(
    name="row", site=pair(1), sites=12,
    on_site=lambda x, v, p: v[0] ** 2 / 2 - sympy.sin(x[0]) ** 2 / 2,
    on_bond=lambda x, y, p: -((y[0] - x[0] - 1) ** 2) / 2,
    x0=(np.arange(12) + 0.2 * np.sin(1.3 * np.arange(12)))[:, None],
    v0=0.3 * np.cos(2.1 * np.arange(12))[:, None],
    symmetries={"nothing": lambda x, p: [0]},
)  # fmt: skip

shaken = replace(
    row, name="shaken", duration=8, symmetries={},
    on_site=lambda x, v, p, t: v[0] ** 2 / 2 - (1 + sympy.sin(3 * t) / 3) * x[0] ** 2 / 2,
)  # fmt: skip


#: springs of one strength, but for one
springs = replace(
    row, name="springs", symmetries={},
    parameters={"k": np.where(np.arange(11) == 4, 2.0, 1.0)},
    on_bond=lambda x, y, p: -p.k * (y[0] - x[0] - 1) ** 2 / 2,
)  # fmt: skip


@discretisation(order=2)
def each_spring(L, G, x, u, h):
    """The middle of a step, between two points that the strength of a spring sets apart."""
    m, off = G.target(x, u, h / 2), h**2 * (L.parameters.k if len(x) == 2 else 0)
    return h * (L(G.target(m, u, off), u) + L(G.target(m, u, -off), u)) / 2


@discretisation(order=2)
def one_spring(L, G, x, u, h):
    """Of order 1 at the spring whose strength is not 1."""
    off = (L.parameters.k - 1) / 10**6 if len(x) == 2 else 0
    return h * L(G.target(x, u, (Rational(1, 2) + off) * h), u)


#: a bead on a line with a ball in it, at each site
balls_on_a_line = Lattice(
    name="balls-on-a-line", site=product(pair(1), lie_group(so(3))), sites=4,
    parameters={"mass": np.array([1.0, 1, 2, 1])},
    on_site=lambda x, v, p: p.mass * v.dot(v) / 2 - x[0] ** 4 / 4,
    on_bond=lambda x, y, p: -((y[0] - x[0]) ** 2) / 2, x0=np.ones((4, 1)), v0=np.ones((4, 4)),
)  # fmt: skip


@discretisation(order=2)
def turning(L, G, x, u, h):
    """The ball of mass 2 turns too fast by 10⁻⁶, which neither x nor μ tells."""
    m, still = G.target(x, u, h / 2), sympy.Matrix([u[0], *[0] * (len(u) - 1)])
    off = (L.parameters.mass - 1) / 10**6 if len(x) == 1 else 0
    return h * L(m, u) + h * off * (L(m, u) - L(m, still))


@discretisation(order=2)
def heavy(L, G, x, u, h):
    """Not consistent: V too large by 10⁻¹⁰."""
    m = G.target(x, u, h / 2)
    return h * L(m, u) + h * L(m, 0 * u) / 10**10


@discretisation(order=2)
def rounded_middle(L, G, x, u, h):
    """Sound in double precision: weights that are floats."""
    m = G.target(x, u, h / 2)
    return h * (0.1 * L(m, u) + 0.2 * L(m, u) + 0.7 * L(m, u))


#: masses that begin at the centres of rings, where the distance from these has no slope
rings = Lattice(
    name="rings", site=pair(2), sites=4, on_site=lambda x, v, p: v.dot(v) / 2,
    on_bond=lambda x, y, p: -(y - x).dot(y - x) / 200,
    contact=lambda x, p: [1 - sympy.sqrt(x.dot(x))], restitution=1, x0=np.zeros((4, 2)),
    v0=np.array([[0.4, 0], [-0.4, 0.1], [0.4, 0.2], [-0.4, 0.3]]), step="1/20",
)  # fmt: skip

#: a chain with dampers between its sites and a drive in its bonds, one end fixed
driven = Lattice(
    name="driven", site=pair(1), sites=8, on_site=lambda x, v, p: v[0] ** 2 / 2,
    on_bond=lambda x, y, p, t: -((y[0] - x[0] - sympy.sin(2 * t) / 4) ** 2) / 2,
    bond_force=lambda x, y, v, w, p: [(w[0] - v[0]) / 9, (v[0] - w[0]) / 9], fixed=[0],
    x0=np.sin(np.arange(8.0))[:, None], v0=np.zeros((8, 1)), step="1/10",
)  # fmt: skip
#: the same at rest at the origin, so that its start has no size
at_rest = replace(driven, name="at-rest", x0=np.zeros((8, 1)))
#: the chain as at first, without the dampers
shaken = replace(driven, name="shaken", bond_force=None)
#: balls in a row that a first one strikes, of unequal masses
balls = Lattice(
    name="balls", site=pair(1), sites=4, parameters={"mass": np.array([4.0, 3, 2, 1])},
    on_site=lambda x, v, p: p.mass * v[0] ** 2 / 2, bond_contact=lambda x, y, p: [y[0] - x[0] - 1],
    restitution=1, x0=1.05 * np.arange(4.0)[:, None], v0=np.eye(4)[:, :1], step="1/50",
)  # fmt: skip
#: a chain whose dampers keep its momentum, with a drag that changes it; and with a spring to each
#: site's own place, so that its momentum is of no symmetry
damped = Lattice(
    name="damped", site=pair(1), sites=6, on_site=lambda x, v, p: v[0] ** 2 / 2,
    on_bond=lambda x, y, p: -((y[0] - x[0]) ** 2) / 2, force=lambda x, v, p: [-v[0] / 7],
    bond_force=lambda x, y, v, w, p: [(w[0] - v[0]) / 9, (v[0] - w[0]) / 9], step="1/10",
    x0=np.sin(np.arange(6.0))[:, None], v0=np.cos(np.arange(6.0))[:, None],
    symmetries={"shift": lambda x, p: [1]},
)  # fmt: skip
held_damped = replace(
    damped, name="held-damped", on_site=lambda x, v, p: v[0] ** 2 / 2 - x[0] ** 2 / 10**6
)


@discretisation(order=2)
def early(L, G, x, u, h):
    """The middle of a step, but a hundredth of it at the time of the start."""
    middle = G.target(x, u, h / 2)
    at_start = sympy.Matrix([*middle[:-1], x[-1]])
    return h * (99 * L(middle, u) + L(at_start, u)) / 100


odd = Lattice(
    name="odd", site=pair(1), sites=6, parameters={}, x0=[[1], [2], [-1], [-1], [-2], [1]],
    v0=np.zeros((6, 1)), on_site=lambda x, v, p: v[0] ** 2 / 2 - x[0] ** 2 / 2, bonds="ring",
    on_bond=lambda x, y, p: -((y[0] - x[0]) ** 4) / 8, step="1/50",
    symmetries={"shift": lambda x, p: [1]},
)  # fmt: skip
