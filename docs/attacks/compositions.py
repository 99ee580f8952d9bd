"""Compositions with coefficients of one's own, right and wrong: the second table of verdicts.md."""

from discmech import discretisation, midpoint
from discmech.integrators.rules import compose, splitting

g = 1 / (2 - 2 ** (1 / 3))
jump = compose(midpoint, [g, 1 - 2 * g, g], order=4, name="jump")
#: no palindrome, and of order 3 by the conditions of two letters
ruth = splitting(["7/24", "2/3", "3/4", "-2/3", "-1/24", 1], name="ruth-3")


@discretisation(order=2)
def slow_clock(L, G, x, u, h):
    """Its potential is too small by a thousandth: of no order, whatever it is composed to."""
    return h * L(G.target(x, u, h / 2), u) + h * L(G.target(x, u, h / 2), 0 * u) / 1000


composed = compose(slow_clock, [g, 1 - 2 * g, g], name="composed-clock")
