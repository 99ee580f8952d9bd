"""The pair groupoid Rⁿ×Rⁿ ⇉ Rⁿ: discrete mechanics on TQ (paper, section 3.6.1)."""

from __future__ import annotations

from typing import Any

from ..errors import BadInput
from ..numbers.lazy import sympy
from .groupoid import Groupoid


class PairGroupoid(Groupoid):
    """Arrows (x, y) with u = (y − x)/h: b = x + hu, p = u + v, ι = −u, ρ = hI, L = R = I."""

    kind = "pair"

    def __init__(self, n: int) -> None:
        if not isinstance(n, int) or n < 1:
            raise BadInput(f"pair({n!r}): the dimension of the base is a whole number from 1.")
        self.dim_x = self.dim_u = n

    @property
    def name(self) -> str:
        return f"pair({self.dim_x})"

    def target(self, x: Any, u: Any, h: Any) -> Any:
        return x + h * u

    def product(self, x: Any, u: Any, v: Any, h: Any) -> Any:
        return u + v

    @property
    def left_is_identity(self) -> bool:
        return True

    def inverse_left(self, x: Any, w: Any, h: Any) -> Any:
        """The identity."""
        return sympy.eye(self.dim_u)

    def velocity(self, x: Any, w: Any, dw: Any, h: Any) -> Any:
        return dw

    def increment(self, x: Any, u: Any, h: Any) -> Any:
        return h * u


def pair(n: int) -> PairGroupoid:
    """The pair groupoid of Rⁿ."""
    return PairGroupoid(n)
