"""Rules without the modified equation they declare: `python modified.py` ends as the command."""

import sys

import sympy

from discmech import discretisation, one_step
from discmech.studies.command import main


@one_step(order=2)
def losing(s, z, h):
    """Störmer–Verlet, which then loses h³/1000 of its momentum: no form is kept."""
    x, mu = s.split(z)
    mu = mu - h / 2 * s.split(s.dH(z))[0]
    x = x + h * s.split(s.dH(s.join(x, mu)))[1]
    mu = mu - h / 2 * s.split(s.dH(s.join(x, mu)))[0]
    return s.join(x, (1 - h**3 / 1000) * mu)


@discretisation(order=2)
def bumpy(L, G, x, u, h):
    """Two points with weights of 1/2, but where x is 1/2: there they differ by 1/10."""
    off = sympy.exp(-(((x[0] - sympy.Rational(1, 2)) * 40) ** 2)) / 20
    half = sympy.Rational(1, 2)
    first, second = (L(G.target(x, u, k * h / 3), u) for k in (1, 2))
    return h * ((half + off) * first + (half - off) * second)


if __name__ == "__main__":
    scene, rule = ("pendulum", "bumpy") if sys.argv[1:] == ["bumpy"] else ("henon-heiles", "losing")
    sys.exit(main(["modified", scene, f"{__file__}:{rule}", "--order", "2"]))
