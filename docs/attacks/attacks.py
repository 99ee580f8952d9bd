"""Scenes and rules that once bought a verdict: what docs/verdicts.md is about."""

from fractions import Fraction

import sympy

from discmech import discretisation, scenes
from discmech.integrators.scene import Conserved

KEPLER, PENDULUM = scenes.get("kepler"), scenes.get("pendulum")


def in_action(name, power):
    """Kepler's problem with an action of 10^power."""
    scale = sympy.Integer(10) ** power
    return KEPLER.with_values(
        name=name, lagrangian=lambda x, v, p: scale * KEPLER.lagrangian(x, v, p)
    )


tiny_action, small_action, large_action = (
    in_action("tiny-action", -60), in_action("small-action", -10), in_action("large-action", 10),
)  # fmt: skip

FAR = sympy.Matrix([10**10, 0])
far_frame = KEPLER.with_values(
    name="far-frame",
    lagrangian=lambda x, v, p: KEPLER.lagrangian(x - FAR, v, p),
    x0=[KEPLER.x0[0] + 10**10, KEPLER.x0[1]],
    symmetries=(),
)


def with_quantity(name, part, constant):
    """Angular momentum, with a part of x that is not kept and a constant."""
    moved = Conserved(
        "moved", lambda x, mu, p: x[0] * mu[1] - x[1] * mu[0] + x[0] / part + constant
    )
    return KEPLER.with_values(name=name, symmetries=[moved])


constant_added = with_quantity("constant-added", 10**6, 10**12)
short_drift = with_quantity("short-drift", 10**13, 0)

PERIOD = Fraction(62831853071795864769, 10**19)
whole_period = scenes.get("harmonic").with_values(
    name="whole-period", duration=PERIOD, step=PERIOD / 64
)


@discretisation(order=2, name="slightly-wrong")
def slightly_wrong(L, G, x, u, h):
    """The midpoint rule with a potential that is too large by 10⁻⁸ h."""
    middle = G.target(x, u, h / 2)
    return h * L(middle, u) + h**2 * L(middle, 0 * u) / 10**8


@discretisation(order=2, name="wrong-in-one")
def wrong_in_one(L, G, x, u, h):
    """The midpoint rule, of first order in one component that weighs little."""
    return h * L(G.target(x, u, h / 2), u) + h**2 * sympy.sin(x[1]) / 10**9


@discretisation(order=2, name="gauged")
def gauged(L, G, x, u, h):
    """The midpoint rule with h (f(b) − f(x)): momenta are of order 1, points of order 2."""
    change = sympy.sin(G.target(x, u, h)[0]) - sympy.sin(x[0])
    return h * L(G.target(x, u, h / 2), u) + h * change / 10**8
