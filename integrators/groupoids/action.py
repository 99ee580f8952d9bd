"""The action groupoid of a matrix group on row vectors, x ↦ x·τ(hu) (paper, section 3.6.3)."""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any

from ..algebras import MatrixAlgebra
from ..errors import BadInput
from ..retractions import Retraction, cayley
from .lie_group import RetractionGroupoid


class ActionGroupoid(RetractionGroupoid):
    """`rows` row vectors of length N, moved together by the right action x ↦ x·τ(hu).

    One row: advected vectors such as the gravity direction of the heavy top. N rows: the group
    acting on itself, whose x is the attitude (flattened row by row).
    """

    kind = "action"

    def __init__(self, algebra: MatrixAlgebra, retraction: Retraction, rows: int = 1) -> None:
        super().__init__(algebra, retraction)
        if type(rows) is not int or rows < 1:
            raise BadInput(f"rows is {rows!r}: give a whole number from 1.")
        self.rows, self.dim_x = rows, rows * algebra.size

    @property
    def name(self) -> str:
        rows = f", rows={self.rows}" if self.rows > 1 else ""
        return f"action({self.algebra.name}{rows})"

    def target(self, x: Any, u: Any, h: Any) -> Any:
        return x + self.increment(x, u, h)

    def increment(self, x: Any, u: Any, h: Any) -> Any:
        """x·(τ(hu) − e), n×1."""
        return self._at(self._increment, x=x, u=u, h=h)

    @cached_property
    def _increment(self) -> Any:
        from sympy import cancel, eye

        s = self._symbols
        displacement = self.element(s["u"], s["h"]) - eye(self.algebra.size)
        return self._act(s["x"], displacement.applyfunc(cancel))

    def rho(self, x: Any, h: Any) -> Any:
        """ρ(x) with columns h·x·e_γ, n×m."""
        from sympy import Matrix

        return h * Matrix.hstack(*[self._act(x, e) for e in self.algebra._matrices])

    def point_slope(self, x: Any, u: Any, h: Any, theta: Any, z: Any) -> Any:
        """∂z/∂u = ρ(z) L⁻¹ at the step θh: small, since it is written with z."""
        inverse_left, _ = self._differential(theta)
        return self.rho(z, theta * h) * self._at(inverse_left, u=u, h=h)

    def point_fields(self, x: Any, u: Any, h: Any, theta: Any, z: Any) -> tuple[Any, Any]:
        """e→ and e← on z = x·τ(θhu): ρ̂(z)·h L_θ⁻¹(θR − R_θ) and ρ̂(z)·θh L_θ⁻¹ L."""
        if theta == 1:
            return super().point_fields(x, u, h, theta, z)
        inverse_left, right = self._differential(theta)
        right = self._at(inverse_left * right, u=u, h=h)
        left = self._at(inverse_left, u=u, h=h) * self.L(x, u, h)
        return self.rho(z, h) * right, theta * self.rho(z, h) * left

    @lru_cache(maxsize=32)  # noqa: B019 - a handful of groupoids live as long as the program
    def _differential(self, theta: Any) -> tuple[Any, Any]:
        """(L_θ⁻¹, θR − R_θ) with L_θ, R_θ those of the step θh, in `_symbols`."""
        u, h = self._symbols["u"], self._symbols["h"]
        inverse_left = self.tau.inverse_left_field(self.algebra, theta * h * u)
        partial = {h: theta * h}
        _, right = self._fields
        return inverse_left, (theta * right - right.subs(partial)).applyfunc(lambda e: e.expand())

    def _act(self, x: Any, matrix: Any) -> Any:
        size = self.algebra.size
        return (x.reshape(self.rows, size) * matrix).reshape(self.dim_x, 1)


def action(
    algebra: MatrixAlgebra, retraction: Retraction = cayley, rows: int = 1
) -> ActionGroupoid:
    """The action groupoid of a matrix group on `rows` row vectors."""
    return ActionGroupoid(algebra, retraction, rows)
