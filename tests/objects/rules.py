"""The rules that are tested with every scene; families of rules have tests of their own."""

from discmech.integrators import discretisation, imex, midpoint, rectangle, trapezoidal
from discmech.integrators.rules import own

RULES = {r.name: r for r in (rectangle, midpoint, trapezoidal, imex, own)}
#: rules that serve every Lagrangian
PLAIN = ("rectangle", "midpoint", "trapezoidal")


@discretisation()
def two_thirds(L, G, x, u, h):
    """An asymmetric two-point rule: the mean of L at one third and two thirds."""
    return h * L(G.target(x, u, h / 3), u) / 2 + h * L(G.target(x, u, 2 * h / 3), u) / 2
