"""Scenes of each kind of groupoid under friction that couples their axes."""

from functools import cache

from discmech.integrators import Scheme, rules, scenes


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
