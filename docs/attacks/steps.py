"""Steps that vary: sound ones, the naive one, and a σ that cannot be used."""

import sympy

from discmech import Scene, pair, scenes, vary
from discmech.integrators.rules import get


def fall(x, mu, p):
    return x.dot(x) ** sympy.Rational(3, 4)


def turned(x, mu, p):
    """A σ of the angle and of the momentum, too."""
    return x.dot(x) * (3 + x[0] / sympy.sqrt(x.dot(x))) / (4 + mu.dot(mu))


trapezoidal = get("trapezoidal")
naive = vary(trapezoidal, fall, "naive", name="naive")
#: the steps of a rule that is exact in itself do not help: they are others on the way back
naive_gauss = vary(get("gauss-4"), fall, "naive", name="naive-gauss")
reversible = vary(get("kahan-li-6:trapezoidal"), turned, "reversible", name="reversible")
poincare = vary(get("triple-jump:rectangle"), fall, "poincare", name="poincare")
explicit = vary(get("runge-kutta-4"), name="explicit")

kinked = vary(trapezoidal, lambda x, mu, p: 1 + sympy.Abs(x[0]), name="kinked")
column = vary(trapezoidal, lambda x, mu, p: x, name="column")
negative = vary(trapezoidal, lambda x, mu, p: x[1] - 1, name="negative")
of_momentum = vary(trapezoidal, turned, "poincare", name="of-momentum")

comet = scenes.get("kepler").with_values(
    name="comet", x0=["1/20", 0], v0=[0, sympy.sqrt(39)], step="1/2000"
)  # e = 0.95
well = Scene(
    name="well",
    groupoid=pair(1),
    lagrangian=lambda x, v, p: v[0] ** 2 / 2 - x[0] ** 4 / 4,
    sigma=lambda x, mu, p: 1 / (1 + x[0] ** 2),
    x0=[2],
    v0=[0],
    duration=5,
    step="1/20",
)
