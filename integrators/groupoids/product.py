"""The product of two groupoids, such as pair × group (paper, last remark of section 3)."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

from ..errors import BadInput
from ..numbers import sympy
from .groupoid import Groupoid


class ProductGroupoid(Groupoid):
    """Arrows are pairs of arrows: x = (x₁, x₂), u = (u₁, u₂); every map acts block by block.

    pair × group: ρ = (hI, 0), L and R block-diagonal.
    """

    kind = "product"
    #: the principal connection that the coordinates are adapted to, or None
    connection: Callable[..., Any] | None = None

    def __init__(self, first: Groupoid, second: Groupoid) -> None:
        for part in (first, second):
            if not isinstance(part, Groupoid):
                raise BadInput(f"a product of {part!r}: give two groupoids, such as pair(1).")
        self.parts = (first, second)
        self.dim_x = first.dim_x + second.dim_x
        self.dim_u = first.dim_u + second.dim_u
        self.mend = first.mend or second.mend
        names = dict.fromkeys(g.retraction for g in self.parts if g.retraction)
        self.retraction = " and ".join(names) or None
        self.by_user = first.by_user or second.by_user

    @property
    def name(self) -> str:
        return " × ".join(g.name for g in self.parts)

    def with_retraction(self, retraction: Any) -> Groupoid:
        parts = [g.with_retraction(retraction) for g in self.parts]
        if all(new is old for new, old in zip(parts, self.parts, strict=True)):
            return self
        return type(self)(*parts)

    def check(self) -> None:
        for part in self.parts:
            part.check()

    def base(self, x: Any) -> tuple[Any, Any]:
        """(x₁, x₂)."""
        n = self.parts[0].dim_x
        return x[:n, :], x[n:, :]

    def fibre(self, u: Any) -> tuple[Any, Any]:
        """(u₁, u₂)."""
        m = self.parts[0].dim_u
        return u[:m, :], u[m:, :]

    def _each(self, *vectors: tuple[Any, Any]) -> Any:
        """(part, its vectors) for both parts."""
        return zip(self.parts, *vectors, strict=True)

    def group_parts(self, x: Any, u: Any, h: Any) -> list[tuple[Any, Any]]:
        found = (g.group_parts(y, w, h) for g, y, w in self._each(self.base(x), self.fibre(u)))
        return [part for parts in found for part in parts]

    def target(self, x: Any, u: Any, h: Any) -> Any:
        return _stacked(g.target(y, w, h) for g, y, w in self._each(self.base(x), self.fibre(u)))

    def product(self, x: Any, u: Any, v: Any, h: Any) -> Any:
        vectors = self.base(x), self.fibre(u), self.fibre(v)
        return _stacked(g.product(y, w, z, h) for g, y, w, z in self._each(*vectors))

    def element(self, u: Any, h: Any) -> Any:
        """The element of the part that comes from a matrix group; of two such, block-diagonal."""
        if not self.retraction:
            return super().element(u, h)
        found = [g.element(w, h) for g, w in self._each(self.fibre(u)) if g.retraction]
        return sympy.Matrix.diag(*found)

    def increment(self, x: Any, u: Any, h: Any) -> Any:
        """Both increments, n×1."""
        both = self._each(self.base(x), self.fibre(u))
        return _stacked(g.increment(y, w, h) for g, y, w in both)

    def rho(self, x: Any, h: Any) -> Any:
        """ρ₁ and ρ₂, n×m; (hI, 0) for pair × group."""
        return _blocks(g.rho(y, h) for g, y in self._each(self.base(x)))

    def L(self, x: Any, u: Any, h: Any) -> Any:
        """L₁ and L₂, m×m."""
        return _blocks(g.L(y, w, h) for g, y, w in self._each(self.base(x), self.fibre(u)))

    def R(self, x: Any, v: Any, h: Any) -> Any:
        """R₁ and R₂, m×m."""
        return _blocks(g.R(y, w, h) for g, y, w in self._each(self.base(x), self.fibre(v)))

    def inverse_left(self, x: Any, w: Any, h: Any) -> Any:
        """L₁⁻¹ and L₂⁻¹, m×m."""
        both = self._each(self.base(x), self.fibre(w))
        return _blocks(g.inverse_left(y, v, h) for g, y, v in both)

    @property
    def left_is_identity(self) -> bool:  # type: ignore[override]
        return all(g.left_is_identity for g in self.parts)

    def structure_functions(self, x: Any, h: Any) -> list[Any]:
        """C₁ and C₂ in blocks: fields of different parts commute."""
        first, second = (g.structure_functions(y, h) for g, y in self._each(self.base(x)))
        return [
            *(_blocks([c, sympy.zeros(len(second))]) for c in first),
            *(_blocks([sympy.zeros(len(first)), c]) for c in second),
        ]

    def point_slope(self, x: Any, u: Any, h: Any, theta: Any, z: Any) -> Any:
        vectors = self.base(x), self.fibre(u), self.base(z)
        return _blocks(g.point_slope(y, w, h, theta, a) for g, y, w, a in self._each(*vectors))

    def point_fields(self, x: Any, u: Any, h: Any, theta: Any, z: Any) -> tuple[Any, Any]:
        vectors = self.base(x), self.fibre(u), self.base(z)
        found = [g.point_fields(y, w, h, theta, a) for g, y, w, a in self._each(*vectors)]
        return _blocks(right for right, _ in found), _blocks(left for _, left in found)

    @cached_property
    def symmetric_chart(self) -> bool:
        """Whether both charts are."""
        return all(g.symmetric_chart for g in self.parts)

    @cached_property
    def _inversion(self) -> Any:
        s = self._symbols
        if any(g._inversion is None for g in self.parts):
            return None
        both = self._each(self.base(s["x"]), self.fibre(s["u"]))
        return _stacked(g.inversion(y, w, s["h"]) for g, y, w in both)


def _stacked(columns: Any) -> Any:
    return sympy.Matrix.vstack(*columns)


def _blocks(matrices: Any) -> Any:
    return sympy.Matrix.diag(*matrices)
