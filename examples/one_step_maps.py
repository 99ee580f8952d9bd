"""Three one-step maps on the dual algebroid: explicit, implicit, and with stages.

None has a discrete Lagrangian: the bench asks of them order, Poisson form, momenta and energy. On
the rigid body none is Poisson, and only the first one loses energy.
"""

from sympy import Rational, sqrt

from discmech import check, one_step, show


@one_step(order=4)
def rk4(s, z, h):
    """The classical Runge-Kutta method."""
    k1 = s.f(z)
    k2 = s.f(z + h * k1 / 2)
    k3 = s.f(z + h * k2 / 2)
    k4 = s.f(z + h * k3)
    return z + h * (k1 + 2 * k2 + 2 * k3 + k4) / 6


@one_step(order=2, implicit=True)
def simpson_field(s, z, Z, h):
    """The bracket at the middle with Simpson's mean of dH: keeps an energy of degree up to four."""
    middle = (z + Z) / 2
    mean = (s.dH(z) + 4 * s.dH(middle) + s.dH(Z)) / 6
    return Z - z - h * s.B(middle) * mean


@one_step(order=4, stages=2)
def gauss(s, z, h, K):
    """Gauss collocation with two nodes: the new Z, and what vanishes at the stages K."""
    a, b = (Rational(1, 4) + sign * sqrt(3) / 6 for sign in (-1, 1))
    first, second = z + h * (K[0] / 4 + a * K[1]), z + h * (b * K[0] + K[1] / 4)
    return z + h * (K[0] + K[1]) / 2, [K[0] - s.f(first), K[1] - s.f(second)]


MAPS = [rk4, simpson_field, gauss]


def main():
    return [
        check("order", scenes=["rigid-body"], rules=MAPS, digits=[50], steps=32),
        check("symplecticity", scenes=["rigid-body"], rules=MAPS, digits=[50], steps=8),
        check("energy", scenes=["rigid-body"], rules=MAPS, steps=20_000),
    ]


if __name__ == "__main__":
    for result in main():
        show(result)
