"""A retraction of one's own: canonical coordinates of the second kind on SO(3).

τ(ξ) = exp(ξ₁ê₁) exp(ξ₂ê₂) exp(ξ₃ê₃), three elementary rotations (Tait–Bryan angles). It is not odd:
τ(−ξ) ≠ τ(ξ)⁻¹, so u at half a step is not the velocity of the middle. Rules at points of the
straight step have order 1 in this chart, rules that take velocities from curves keep their own.
The chart ends at ξ₂ = ±π/2, where the first and the third axis coincide. The product follows from
`element_in` and `coordinates_in`.
"""

import math
from dataclasses import dataclass

import numpy as np
from sympy import Matrix, asin, atan2, cos, pi, sin, zeros

from discmech import BadInput, check, lie_group, scenes, so
from discmech.integrators.retractions import Retraction


def angles(g, asin=asin, atan2=atan2):
    """ξ with τ(ξ) = g, |ξ₂| < π/2."""
    return [atan2(-g[1, 2], g[2, 2]), asin(g[0, 2]), atan2(-g[0, 1], g[0, 0])]


@dataclass(frozen=True)
class SecondKind(Retraction):
    """Canonical coordinates of the second kind on SO(3), for the basis that so(3) has here."""

    name: str = "second-kind"

    def check(self, algebra):
        if algebra.basis != so(3).basis:
            raise BadInput(f"coordinates of the second kind are for so(3), not {algebra.name}.")

    def displacement(self, algebra, xi):
        total = zeros(3)
        for axis, angle in zip(algebra.basis, xi, strict=True):  # (e + a)(e + b) − e = a + b + ab
            turn = Matrix(axis)
            turn = sin(angle) * turn + 2 * sin(angle / 2) ** 2 * turn**2
            total += turn + total * turn
        return total

    def inverse(self, algebra, xi):
        return Matrix(angles(self.element(algebra, xi).T))

    def invariant_fields(self, algebra, xi):
        (c1, c2, c3), (s1, s2, s3) = xi.applyfunc(cos), xi.applyfunc(sin)
        left = Matrix([[c3 / c2, -s3 / c2, 0], [s3, c3, 0], [-s2 * c3 / c2, s2 * s3 / c2, 1]])
        right = Matrix([[1, s2 * s1 / c2, -s2 * c1 / c2], [0, c1, s1], [0, -s1 / c2, c1 / c2]])
        return left, right

    def inverse_left_field(self, algebra, xi):
        (_, c2, c3), (_, s2, s3) = xi.applyfunc(cos), xi.applyfunc(sin)
        return Matrix([[c2 * c3, s3, 0], [-c2 * s3, c3, 0], [s2, 0, 1]])

    def element_in(self, frame, xi):
        functions, g = frame.numbers.namespace(), frame.e
        for k, angle in enumerate(xi):
            axis = frame.hat(frame.e[k])
            g = g @ (frame.e + functions["sin"](angle) * axis
                     + (1 - functions["cos"](angle)) * axis @ axis)  # fmt: skip
        return g

    def coordinates_in(self, frame, g):
        functions = frame.numbers.namespace()
        return np.array(angles(g, functions["asin"], functions["atan2"]))

    def extents(self, algebra, xi):
        return [("rest", 1 - (2 * xi[1] / pi) ** 2)]

    def reach(self, algebra):
        return 16 / 9  # half the way, |ξ₂| = π/4

    def distance_and_margin(self, algebra, xi):
        rest = 1 - (2 * xi[1] / math.pi) ** 2
        return math.pi / 2 - abs(xi[1]), max(0.0, rest)


second_kind = SecondKind()
body = scenes.get("rigid-body").with_values(
    name="rigid-body-second-kind", groupoid=lie_group(so(3), second_kind)
)
top = scenes.get("heavy-top").with_retraction(second_kind).with_values(name="top-second-kind")


def main():
    order = check("order", scenes=[body], rules=["midpoint", "gauss-2"], digits=[16])
    return order, check("symplecticity", scenes=[top], rules=["midpoint"], digits=[16])


if __name__ == "__main__":
    for result in main():
        print(result["study"], result["verdict"])
