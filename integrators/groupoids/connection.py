"""Pair × group in coordinates adapted to a principal connection: discrete Lagrange–Poincaré.

A G-invariant Lagrangian on T(M×G) is one on TM × g; with a connection A it is written in ẋ and
η = ξ + A(x)ẋ (Cendra, Marsden, Ratiu, *Lagrangian reduction by stages*). The groupoid stays
(M×M)×G; only its chart is another,

    (w, η)  ↦  (w, ξ),   ξ = η − A(x + hw/2) w,   the arrow being (x, x + hw, τ(hξ)).

With A in the middle of the step the chart stays symmetric: (w, η)⁻¹ = (−w, −η), so that symmetric
rules keep their order. Curvature then appears by itself, in the structure functions of the frame
ē_i = ∂_i − A_i, e_a:

    [ē_i, ē_j] = (∂_j A_i − ∂_i A_j + [A_i, A_j])^a e_a,    [ē_i, e_a] = −[A_i, e_a].
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

from ..errors import BadInput, shown
from ..numbers import sympy
from ..numbers.types import Column, Expression, SymbolicMatrix
from .groupoid import Groupoid
from .lie_group import LieGroup
from .local import column_of
from .pair import PairGroupoid
from .product import ProductGroupoid


class ConnectionGroupoid(ProductGroupoid):
    """product(pair(n), lie_group(g)) with fibre coordinates (w, η); A(x) is k×n, k = dim g."""

    def __init__(
        self, first: Groupoid, second: Groupoid, connection: Callable[[Column], SymbolicMatrix]
    ) -> None:
        super().__init__(first, second)
        if not isinstance(first, PairGroupoid) or not isinstance(second, LieGroup):
            raise BadInput(
                f"{self.name}: a connection belongs to product(pair(n), lie_group(algebra))."
            )
        if not callable(connection):
            raise BadInput(f"{self.name}: connection is {shown(connection)}; give a function of x.")
        self.connection: Callable[[Column], SymbolicMatrix] = connection
        self.by_user = True

    @property
    def name(self) -> str:
        return f"{super().name}, connection"

    def product(self, x: Column, u: Column, v: Column, h: Expression) -> Column:
        y = self.target(x, u, h)
        plain = super().product(x, self._plain(x, u, h), self._plain(y, v, h), h)
        w, xi = self.fibre(plain)
        return w.col_join(xi + self._A(x + h * w / 2) * w)

    def group_parts(self, x: Column, u: Column, h: Expression) -> list[tuple[Groupoid, Column]]:
        return super().group_parts(x, self._plain(x, u, h), h)

    def element(self, u: Column, h: Expression) -> SymbolicMatrix:
        raise BadInput(
            f"{self.name}: the group element depends on x too; take the product without connection."
        )

    def L(self, x: Column, u: Column, h: Expression) -> SymbolicMatrix:
        """[[1, 0], [∂(Aw)/∂w − L_ξ A(y), L_ξ]] with A(x + hw/2), m×m."""
        w, xi = self.fibre(self._plain(x, u, h))
        left, middle = self.parts[1].L(x[:0, :], xi, h), x + h * w / 2
        corner = self._A(middle) + h * self._along(middle, w) / 2 - left * self._A(x + h * w)
        return self._sheared(corner, left)

    def R(self, x: Column, v: Column, h: Expression) -> SymbolicMatrix:
        """[[1, 0], [∂(Aw)/∂w − h ∂(Aw)/∂x − R_ξ A(x), R_ξ]]: the start moves the middle, m×m."""
        w, xi = self.fibre(self._plain(x, v, h))
        right, middle = self.parts[1].R(x[:0, :], xi, h), x + h * w / 2
        corner = self._A(middle) - h * self._along(middle, w) / 2 - right * self._A(x)
        return self._sheared(corner, right)

    def inverse_left(self, x: Column, w: Column, h: Expression) -> SymbolicMatrix:
        """[[1, 0], [A(y) − L_ξ⁻¹ ∂(Aw)/∂w, L_ξ⁻¹]], where L_ξ⁻¹ L_ξ of the corner has cancelled."""
        dx, xi = self.fibre(self._plain(x, w, h))
        block, middle = self.parts[1].inverse_left(x[:0, :], xi, h), x + h * dx / 2
        turned = block * (self._A(middle) + h * self._along(middle, dx) / 2)
        return self._sheared(self._A(x + h * dx) - turned, block)

    displacement_at = Groupoid.displacement_at  # the connection ties both parts together

    def structure_functions(self, x: Column, h: Expression) -> list[SymbolicMatrix]:
        """h times the structure functions of (ē_i, e_a): curvature, and the bracket with A."""
        n, k = (g.dim_u for g in self.parts)
        constants = [c / h for c in self.parts[1].structure_functions(x[:0, :], h)]
        A = self._A(x)
        slopes = self._at(self._slopes, x=x)  # row a + k·i: ∂A^a_i/∂x^j
        functions = [sympy.zeros(n + k) for _ in range(n)]
        for a, c in enumerate(constants):
            d = slopes[a::k, :]
            block = sympy.Matrix.diag(d - d.T + A.T * c * A, c)
            block[:n, n:], block[n:, :n] = -A.T * c, -c * A
            functions.append(h * block)
        return functions

    @cached_property
    def _inversion(self) -> Column:
        return -self.symbols["u"]

    def _plain(self, x: Column, u: Column, h: Expression) -> Column:
        """(w, ξ) of (w, η)."""
        w, eta = self.fibre(u)
        return w.col_join(eta - self._A(x + h * w / 2) * w)

    def _A(self, x: Column) -> SymbolicMatrix:
        return self._at(self._matrix, x=x)

    @cached_property
    def _matrix(self) -> SymbolicMatrix:
        """A(x) in `symbols`, k×n."""
        n, k = (g.dim_u for g in self.parts)

        def entries(x: Column) -> list[Expression]:
            matrix = sympy.Matrix(self.connection(x))
            if matrix.shape != (k, n):
                raise BadInput(f"{self.name}: A(x) is {matrix.shape}, but must be {(k, n)}.")
            return list(matrix)

        label = f"{self.name}: A(x)"
        return column_of(entries, k * n, label, self.symbols["x"]).reshape(k, n)

    @cached_property
    def _slopes(self) -> SymbolicMatrix:
        """∂A^a_i/∂x^j in row a + k·i, column j."""
        return self._matrix.vec().jacobian(self.symbols["x"])

    def _along(self, x: Column, w: Column) -> SymbolicMatrix:
        """∂(A(x) w)/∂x at fixed w, k×n."""
        k = self.parts[1].dim_u
        slopes = self._at(self._slopes, x=x)
        return sum((slopes[k * i : k * i + k, :] * e for i, e in enumerate(w)), 0 * slopes[:k, :])

    def _sheared(self, corner: SymbolicMatrix, block: SymbolicMatrix) -> SymbolicMatrix:
        n, k = (g.dim_u for g in self.parts)
        return sympy.eye(n).row_join(sympy.zeros(n, k)).col_join(corner.row_join(block))
