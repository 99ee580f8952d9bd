"""A discretisation: the discrete Lagrangian of one step, from the Lagrangian.

    discmech verify FILE    # what it is worth, on scenes of every kind
    discmech explain pendulum FILE:NAME    # the equations that it makes
    discmech compare FILE midpoint trapezoidal

L(x, u) is the Lagrangian at a point and a velocity, G.target(x, u, t) the point that the velocity
u reaches from x in the time t, on any groupoid. All else is derived.
"""

from discmech import discretisation


@discretisation(order=2)  # what you claim; leave it out and it is only measured
def starter(L, G, x, u, h):
    first, last = G.target(x, u, h / 4), G.target(x, u, 3 * h / 4)
    return h * (L(first, u) + L(last, u)) / 2
