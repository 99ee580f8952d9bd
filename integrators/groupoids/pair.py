"""The pair groupoid Rⁿ×Rⁿ ⇉ Rⁿ: discrete mechanics on TQ (paper, section 3.6.1)."""

from __future__ import annotations

from functools import cached_property
from typing import Any

from ..errors import BadInput
from ..numbers import sympy
from .groupoid import Groupoid


class PairGroupoid(Groupoid):
    """Arrows (x, y) with u = (y − x)/h: b = x + hu, p = u + v, ι = −u, ρ = hI, L = R = I, C = 0."""

    kind = "pair"
    by_user = False

    def __init__(self, n: int) -> None:
        if type(n) is not int or n < 1:
            raise BadInput(f"pair({n!r}): the dimension of the base is a whole number from 1.")
        self.dim_x = self.dim_u = n

    @property
    def name(self) -> str:
        return f"pair({self.dim_x})"

    def target(self, x: Any, u: Any, h: Any) -> Any:
        return x + h * u

    def product(self, x: Any, u: Any, v: Any, h: Any) -> Any:
        return u + v

    def rho(self, x: Any, h: Any) -> Any:
        """hI."""
        return h * sympy.eye(self.dim_u)

    def L(self, x: Any, u: Any, h: Any) -> Any:
        """I."""
        return sympy.eye(self.dim_u)

    R = inverse_left = L  # type: ignore[assignment]

    def structure_functions(self, x: Any, h: Any) -> list[Any]:
        """Zeros: fields on different ends of an arrow commute."""
        return [sympy.zeros(self.dim_u)] * self.dim_u

    def increment(self, x: Any, u: Any, h: Any) -> Any:
        return h * u

    def point_slope(self, x: Any, u: Any, h: Any, theta: Any, z: Any) -> Any:
        return theta * self.rho(x, h)

    def point_fields(self, x: Any, u: Any, h: Any, theta: Any, z: Any) -> tuple[Any, Any]:
        """(θ − 1)hI and θhI."""
        return (theta - 1) * self.rho(x, h), theta * self.rho(x, h)

    @cached_property
    def _inversion(self) -> Any:
        return -self._symbols["u"]


def pair(n: int) -> PairGroupoid:
    """The pair groupoid of Rⁿ."""
    return PairGroupoid(n)
