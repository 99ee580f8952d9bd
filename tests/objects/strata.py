"""Where laws are checked: near the identities, in the middle, near the edge of a chart."""

import sympy
from sympy import Matrix, Rational

from discmech.integrators import exponential

#: how far from the identities, as |hu|: near them, in the middle, near the chart's edge
ARROWS = ("near", "generic", "edge")
STEPS = (Rational(1, 10), Rational(3), Rational(-2, 7))


def arrows(groupoid, stratum, h, seed=0):
    """Exact x and three arrows' coordinates u, v, w with |hu| in the stratum."""
    size = {"near": Rational(1, 10**7), "generic": Rational(1), "edge": Rational(1000)}[stratum]
    by_exponential = exponential.name in (groupoid.retraction or "")
    if by_exponential and stratum != "near":
        size = Rational(2, 5)  # the product ends where an angle reaches π: sums stay below

    def fraction(i):
        """Numbers between −1 and 1 without any pattern, none of them 0."""
        return Rational((7919 * (i + 1) + 104729 * (seed + 1)) % 1999 - 999, 1013)

    def column(start, length, factor):
        return Matrix(length, 1, [fraction(start + i) * factor for i in range(length)])

    n, m = groupoid.dim_x, groupoid.dim_u
    point = {"x": column(0, n, Rational(1, 2)), "h": h, "k": h * Rational(5, 3)}
    for number, name in enumerate("uvw"):
        point[name] = column(100 + 17 * number, m, size / h)
        if by_exponential and stratum == "edge" and name == "u":
            turning = sum(e**2 for e in point[name][: 1 if m == 3 and "se" in groupoid.name else m])
            turning = sympy.sqrt(turning).evalf(20) * abs(h)
            point[name] *= Rational(31415, 10000) / Rational(str(turning))
        elif by_exponential and stratum == "edge":
            point[name] /= 10**6
        if hasattr(groupoid, "connection") and stratum == "edge":
            # the group alone has an edge; a connection is a polynomial in the base, and a thousand
            # away its third derivatives leave difference quotients no digit
            point[name][:n, 0] = point[name][:n, 0] / 1000
        if groupoid.name.startswith("affine") and stratum != "near":
            # the edge of this chart is 1 + hu₀ = 0
            factor = Rational(1, 1000 + number) if stratum == "edge" else Rational(3 + number, 2)
            point[name][0] = (factor - 1) / h
    return point
