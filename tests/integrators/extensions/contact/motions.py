"""Scenes with contact, their schemes and runs, each made once."""

from functools import cache

import sympy

from discmech import Scene, Scheme, midpoint, pair
from discmech.integrators import scenes

BALL = scenes.get("bouncing-ball")
BLOCK = scenes.get("sliding-block")
SPRING = Scene(
    "spring-and-wall", pair(1), lambda x, v, p: (v[0] ** 2 - x[0] ** 2) / 2, x0=[1], v0=[0],
    contact=lambda x, p: [x[0] + sympy.Rational(1, 2)], restitution=1, impacts="located",
)  # fmt: skip


@cache
def scheme(name, rule=midpoint):
    return Scheme(scenes.get(name), rule)


@cache
def run(name, step, steps, impacts, rule=midpoint, digits=16):
    return scheme(name, rule).flow(step, digits, impacts=impacts).trajectory(steps)


def ball(**given):
    values = dict(name="ball", groupoid=pair(1), lagrangian=lambda x, v, p: v.dot(v) / 2 - x[0],
                  x0=[1], v0=[0], contact=lambda x, p: [x[0]]) | given  # fmt: skip
    return Scheme(Scene(**values), midpoint).flow("0.1")
