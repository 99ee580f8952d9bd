"""Inputs of `discmech optimality` that once had a wrong verdict; docs/verdicts.md says which."""

import sympy
from sympy import Integer, Rational

from discmech import Control, Scene, discretisation, pair


def swing(name, length, time, mass):
    """A pendulum steered by one radian, in units of which the old ones are so many."""
    scene = Scene(
        name=name, groupoid=pair(1), parameters={"m": mass, "l": length, "g": 1 / time**2},
        lagrangian=lambda x, v, p: p.m * (v[0] ** 2 / 2 + p.g * p.l**2 * sympy.cos(x[0] / p.l)),
        x0=[0], v0=[0], duration=3 * time, step=time * Rational(1, 20),
    )  # fmt: skip
    return Control(scene, cost=lambda x, v, f, p: f.dot(f) / 2, end=([length], [0]))


one, ten = Integer(1), Integer(10)
small_problem = swing("small", ten**-12, ten**-12, one)
heavy_problem = swing("heavy-swing", one, one, ten**150)
small, heavy = small_problem.scene, heavy_problem.scene

cart = Scene(
    name="cart", groupoid=pair(1), lagrangian=lambda x, v, p: v[0] ** 2 / 2,
    x0=[0], v0=[0], duration=2,
)  # fmt: skip
fuel = Control(cart, cost=lambda x, v, f, p: sympy.sqrt(f[0] ** 2 + Rational(1, 4)), end=([1], [0]))


def free(x, v, p):
    """The Lagrangian that two scenes share."""
    return v[0] ** 2 / 2


short, long = (Scene(name, pair(1), free, x0=[0], v0=[0], duration=T)
               for name, T in (("short", 1), ("long", 2)))  # fmt: skip
fast = Control(short, cost=lambda x, v, f, p: f.dot(f) / 2, end=([1], [0]))
slow = Control(long, cost=lambda x, v, f, p: f.dot(f) / 2 + x[0] ** 2, end=([1], [0]))


@discretisation(order=2)
def another_velocity(L, G, x, u, h):
    """A velocity that is larger by 10⁻⁸: not consistent."""
    return h * L(G.target(x, u, h / 2), u * (1 + Rational(1, 10**8)))
