"""A rule of fourth order with one internal stage: Simpson's quadrature on a parabola.

The path in the chart is w(θ) = θu + θ(1 − θ)s; s is found by making L_d stationary. Written with
`G.velocity` it keeps its order on groups and actions too.
"""

from sympy import Rational

from discmech import check, discretisation, show


@discretisation(order=4, stages=1)
def simpson(L, G, x, u, h, s):
    total = 0
    for theta, weight in ((0, 1), (Rational(1, 2), 4), (1, 1)):
        w, dw = theta * u + theta * (1 - theta) * s[0], u + (1 - 2 * theta) * s[0]
        total += h * Rational(weight, 6) * L(G.target(x, w, h), G.velocity(x, w, dw, h))
    return total


RULES = [simpson]


def main():
    return check("order", scenes=["pendulum", "rigid-body"], rules=RULES, digits=[50], steps=32)


if __name__ == "__main__":
    show(main())
