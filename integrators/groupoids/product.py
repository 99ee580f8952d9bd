"""The product of two groupoids, such as pair × group (paper, last remark of section 3)."""

from __future__ import annotations

from functools import cached_property

from ..errors import BadInput, shown
from ..numbers import sympy
from ..numbers.types import Column, Expression, FieldPair, Function, SymbolicMatrix
from ..retractions import Retraction
from .axioms import check_axioms
from .groupoid import Groupoid, Motion


class ProductGroupoid(Groupoid):
    """Arrows are pairs of arrows: x = (x₁, x₂), u = (u₁, u₂); every map acts block by block.

    pair × group: ρ = (hI, 0), L and R block-diagonal.
    """

    kind = "product"
    by_user = False  # its axioms are those of the parts
    #: x ↦ A(x) of a principal connection, where the fibre coordinates are adapted to one
    connection: Function | None = None

    def __init__(self, first: Groupoid, second: Groupoid) -> None:
        for part in (first, second):
            if not isinstance(part, Groupoid):
                raise BadInput(f"a product of {shown(part)}: give two groupoids, such as pair(1).")
        self.parts = (first, second)
        self.dim_x = first.dim_x + second.dim_x
        self.dim_u = first.dim_u + second.dim_u
        names = dict.fromkeys(g.retraction for g in self.parts if g.retraction)
        self.retraction = " and ".join(names) or None

    @property
    def name(self) -> str:
        return " × ".join(g.name for g in self.parts)

    def with_retraction(self, retraction: Retraction) -> Groupoid:
        parts = tuple(g.with_retraction(retraction) for g in self.parts)
        if parts == self.parts:
            return self
        return type(self)(*parts, *([self.connection] if self.connection else []))

    def check(self) -> None:
        for part in self.parts:
            check_axioms(part)

    def base(self, x: Column) -> tuple[Column, Column]:
        """(x₁, x₂)."""
        n = self.parts[0].dim_x
        return x[:n, :], x[n:, :]

    def fibre(self, u: Column) -> tuple[Column, Column]:
        """(u₁, u₂)."""
        m = self.parts[0].dim_u
        return u[:m, :], u[m:, :]

    def _both(
        self, what: str, x: Column, *fibres_and_h: Column | Expression
    ) -> list[SymbolicMatrix]:
        """Results of the method `what` of both parts, each at its own part of x and the fibres."""
        *fibres, h = fibres_and_h
        vectors = self.base(x), *map(self.fibre, fibres)
        return [getattr(g, what)(*own, h) for g, *own in zip(self.parts, *vectors, strict=True)]

    def group_parts(self, x: Column, u: Column, h: Expression) -> list[tuple[Groupoid, Column]]:
        first, second = self._both("group_parts", x, u, h)
        return [*first, *second]

    def target(self, x: Column, u: Column, h: Expression) -> Column:
        return sympy.Matrix.vstack(*self._both("target", x, u, h))

    def product(self, x: Column, u: Column, v: Column, h: Expression) -> Column:
        return sympy.Matrix.vstack(*self._both("product", x, u, v, h))

    def element(self, u: Column, h: Expression) -> SymbolicMatrix:
        """The element of the part that comes from a matrix group; of two such, block-diagonal."""
        if not self.retraction:
            return super().element(u, h)
        blocks = zip(self.parts, self.fibre(u), strict=True)
        return sympy.Matrix.diag(*[g.element(w, h) for g, w in blocks if g.retraction])

    def increment(self, x: Column, u: Column, h: Expression) -> Column:
        """Both increments, n×1."""
        return sympy.Matrix.vstack(*self._both("increment", x, u, h))

    def rho(self, x: Column, h: Expression) -> SymbolicMatrix:
        """ρ₁ and ρ₂ in blocks, n×m; (hI, 0) for pair × group."""
        return sympy.Matrix.diag(*self._both("rho", x, h))

    def L(self, x: Column, u: Column, h: Expression) -> SymbolicMatrix:
        """L₁ and L₂ in blocks, m×m."""
        return sympy.Matrix.diag(*self._both("L", x, u, h))

    def R(self, x: Column, v: Column, h: Expression) -> SymbolicMatrix:
        """R₁ and R₂ in blocks, m×m."""
        return sympy.Matrix.diag(*self._both("R", x, v, h))

    def inverse_left(self, x: Column, w: Column, h: Expression) -> SymbolicMatrix:
        """L₁⁻¹ and L₂⁻¹ in blocks, m×m."""
        return sympy.Matrix.diag(*self._both("inverse_left", x, w, h))

    def structure_functions(self, x: Column, h: Expression) -> list[SymbolicMatrix]:
        """C₁ and C₂ in blocks: fields of different parts commute."""
        first, second = self._both("structure_functions", x, h)
        return [
            *(sympy.Matrix.diag(c, sympy.zeros(len(second))) for c in first),
            *(sympy.Matrix.diag(sympy.zeros(len(first)), c) for c in second),
        ]

    def point_motion(
        self, x: Column, u: Column, h: Expression, theta: Expression, z: Column
    ) -> Motion:
        own = zip(self.parts, self.base(x), self.fibre(u), self.base(z), strict=True)
        motions = [g.point_motion(y, w, h, theta, a) for g, y, w, a in own]
        return Motion(*(sympy.Matrix.diag(*blocks) for blocks in zip(*motions, strict=True)))

    def displacement_at(self, x: Column, u: Column, h: Expression, theta: Expression) -> FieldPair:
        own = zip(self.parts, self.base(x), self.fibre(u), strict=True)
        fields = [g.displacement_at(y, w, h, theta) for g, y, w in own]
        right, left = (sympy.Matrix.diag(*blocks) for blocks in zip(*fields, strict=True))
        return right, left

    @cached_property
    def _inversion(self) -> Column | None:
        s = self.symbols
        if any(g._inversion is None for g in self.parts):
            return None
        return sympy.Matrix.vstack(*self._both("inversion", s["x"], s["u"], s["h"]))
