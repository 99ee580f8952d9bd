"""The pair groupoid Rⁿ×Rⁿ ⇉ Rⁿ: discrete mechanics on TQ (paper, section 3.6.1)."""

from __future__ import annotations

from functools import cached_property

from ..errors import BadInput, shown
from ..numbers import sympy
from ..numbers.types import Column, Expression, SymbolicMatrix
from .groupoid import Groupoid, Motion


class PairGroupoid(Groupoid):
    """Arrows (x, y) with u = (y − x)/h: b = x + hu, p = u + v, ι = −u, ρ = hI, L = R = I, C = 0."""

    kind = "pair"
    canonical = True
    by_user = False

    def __init__(self, n: int) -> None:
        if type(n) is not int or n < 1:
            raise BadInput(f"pair({shown(n)}): the dimension of the base is a whole number from 1.")
        self.dim_x = self.dim_u = n

    @property
    def name(self) -> str:
        return f"pair({self.dim_x})"

    def target(self, x: Column, u: Column, h: Expression) -> Column:
        return x + h * u

    def product(self, x: Column, u: Column, v: Column, h: Expression) -> Column:
        return u + v

    def rho(self, x: Column, h: Expression) -> SymbolicMatrix:
        return h * sympy.eye(self.dim_u)

    def L(self, x: Column, u: Column, h: Expression) -> SymbolicMatrix:
        return sympy.eye(self.dim_u)

    R = inverse_left = L  # type: ignore[assignment]

    def structure_functions(self, x: Column, h: Expression) -> list[SymbolicMatrix]:
        """Zeros: fields on different ends of an arrow commute."""
        return [sympy.zeros(self.dim_u)] * self.dim_u

    def increment(self, x: Column, u: Column, h: Expression) -> Column:
        return h * u

    def point_motion(
        self, x: Column, u: Column, h: Expression, theta: Expression, z: Column
    ) -> Motion:
        """θhI by u, (θ − 1)hI and θhI along the fields."""
        one = sympy.eye(self.dim_u)
        return Motion(h * one, theta * one, (theta - 1) * one, theta * one)

    @cached_property
    def _inversion(self) -> Column:
        return -self.symbols["u"]


def pair(n: int) -> PairGroupoid:
    """The pair groupoid of Rⁿ."""
    return PairGroupoid(n)
