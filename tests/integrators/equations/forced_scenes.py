"""Scenes of each kind of groupoid under friction that couples their axes; orders in time."""

from fractions import Fraction
from functools import cache

import numpy as np

from discmech.integrators import Scheme, rules, scenes
from discmech.reference import solution


def rubbed(x, v, p):
    """Friction of the axes that couples them, on any groupoid."""
    return [-v[i] / (4 + i) - v[i] * v[i - 1] / 7 for i in range(len(v))]


def with_force(name, force=rubbed):
    return scenes.get(name).with_values(name=f"forced-{name}", force=force)


#: a scene of each kind of groupoid: pairs, a group, an action, pairs with a group
FORCED = ("spring-pendulum", "rigid-body", "heavy-top", "rotor-body")


@cache
def forced(name, rule):
    return Scheme(with_force(name), rules.get(rule))


def errors(one, end, steps):
    """‖(x, μ) − reference‖ at the time `end`, of a scheme with so many steps."""
    exact = solution(one.scene, end, 30)
    wanted = np.array([float(e) for e in (*exact.x, *exact.mu)])
    runs = [one.flow(Fraction(end) / n).trajectory(n, every=n) for n in steps]
    return [float(np.linalg.norm(np.concatenate([r.x[-1], r.mu[-1]]) - wanted)) for r in runs]


def order(one, end, steps):
    """That of two numbers of steps, the second twice the first."""
    coarse, fine = errors(one, end, steps)
    return float(np.log2(coarse / fine))
