"""Constraints that move: one met at the time of the start, and round-off at late times."""

import sympy

from discmech import Scene, discretisation, pair


def _blade(x, p, t):
    """A blade that turns by itself; where it comes to rest, its end moves faster than its step."""
    return [[sympy.sin(t), -sympy.cos(t)]]


turning = Scene(
    name="turning",
    groupoid=pair(2),
    lagrangian=lambda x, v, p: v.dot(v) / 2 - x[0],
    nonholonomic=_blade,
    x0=[0, 0],
    v0=[1, 0],
    duration=4,
    step="1/20",
)


@discretisation(order=2)
def early(L, G, x, u, h):
    """L, and so the constraint, at the start of the step alone."""
    return h * L(x, u)
