"""Compositions with coefficients of one's own, right and wrong: the second table of verdicts.md."""

from discmech import discretisation, midpoint, one_step
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


def yoshida(digits, kick=0):
    """Yoshida's with weights of so many digits, which are floats, and kicks of 1/2 ± kick."""
    w = round(g, digits)

    @one_step(order=4, groupoids="pair", name=f"yoshida-{digits}{'-kicked' if kick else ''}")
    def step(s, z, h):
        for part in (w * h, (1 - 2 * w) * h, w * h):
            z = z - s.join(0 * s.split(z)[0], (0.5 + kick) * part * s.dH(z)[: s.n, :])
            z = z + s.join(part * s.xi(z), 0 * s.split(z)[1])
            z = z - s.join(0 * s.split(z)[0], (0.5 - kick) * part * s.dH(z)[: s.n, :])
        return z

    return step


nine_digits, all_digits, kicked = yoshida(9), yoshida(17), yoshida(17, 1e-9)
seven_digits = yoshida(7)
