"""Action groupoids of a matrix group: x ↦ x·τ(hu), a right action (paper, section 3.7)."""

from __future__ import annotations

from abc import abstractmethod
from functools import cached_property

from ..algebras import MatrixAlgebra
from ..errors import BadInput, line_of, shown
from ..numbers import sympy
from ..numbers.types import Column, Expression, Function, SymbolicMatrix
from ..retractions import Retraction, cayley
from .groupoid import Motion
from .lie_group import RetractionGroupoid
from .local import column_of


class ActionGroupoid(RetractionGroupoid):
    """Base of right actions; a subclass gives `moved` and may state ρ and the increment."""

    kind = "action"

    @abstractmethod
    def moved(self, x: Column, g: SymbolicMatrix) -> Column:
        """x·g for an N×N matrix g of the group, n×1."""

    def target(self, x: Column, u: Column, h: Expression) -> Column:
        return self.moved(x, self.element(u, h))

    def increment(self, x: Column, u: Column, h: Expression) -> Column:
        """x·τ(hu) − x with the difference cancelled, n×1."""
        return self._at(self._increment, x=x, u=u, h=h)

    @cached_property
    def _increment(self) -> Column:
        """The increment in `symbols`: x·(e + d) − x is cancelled while d is still symbols."""
        s, size = self.symbols, self.algebra.size
        d = sympy.Matrix(size, size, lambda i, j: sympy.Symbol(f"d_{i}_{j}"))
        increment = (self.moved(s["x"], sympy.eye(size) + d) - s["x"]).applyfunc(sympy.cancel)
        values = dict(zip(d, self.displacement(s["u"], s["h"]), strict=True))
        return increment.xreplace(values)

    def rho(self, x: Column, h: Expression) -> SymbolicMatrix:
        """ρ(x) with columns h d/ds x·(e + s e_γ) at s = 0, n×m."""
        return h * self._at(self._anchor, x=x)

    @cached_property
    def _anchor(self) -> SymbolicMatrix:
        """ρ̂(x) in `symbols`."""
        size = self.algebra.size
        g = sympy.Matrix(size, size, lambda i, j: sympy.Symbol(f"g_{i}_{j}"))
        slopes = self.moved(self.symbols["x"], g).jacobian(g.reshape(size**2, 1))
        slopes = slopes.subs(dict(zip(g, sympy.eye(size), strict=True)))
        columns = [slopes * e.reshape(size**2, 1) for e in self.algebra.matrices]
        return sympy.Matrix.hstack(*columns).applyfunc(sympy.cancel)

    def point_motion(
        self, x: Column, u: Column, h: Expression, theta: Expression, z: Column
    ) -> Motion:
        """By ρ(z): ∂z/∂u with θ L⁻¹ at the step θh, e→ with lag and e← with lag + lead."""
        slope = theta * self.inverse_left(x, u, theta * h)
        return Motion(self.rho(z, h), slope, *self.displacement_at(x, u, h, theta))


class RowAction(ActionGroupoid):
    """`rows` row vectors of length N, moved together by x ↦ x·τ(hu).

    One row: advected vectors such as the gravity direction of the heavy top. N rows: the group
    acting on itself, whose x is the attitude (flattened row by row).
    """

    def __init__(self, algebra: MatrixAlgebra, retraction: Retraction, rows: int = 1) -> None:
        super().__init__(algebra, retraction)
        self.algebra = algebra.real  # complex rows of length N are real ones of 2N
        if type(rows) is not int or rows < 1:
            raise BadInput(f"rows is {shown(rows)}: give a whole number from 1.")
        self.rows, self.dim_x, self.further = rows, rows * self.algebra.size, (rows,)

    @property
    def name(self) -> str:
        rows = f", rows={self.rows}" if self.rows > 1 else ""
        return f"action({self.algebra.name}{rows}{self._chart})"

    def moved(self, x: Column, g: SymbolicMatrix) -> Column:
        N = self.algebra.size  # entry by entry: sympy's product of matrices has a long way
        return sympy.Matrix([sympy.Add(*(e * g[i, j] for i, e in enumerate(x[at : at + N])))
                             for at in range(0, self.dim_x, N) for j in range(N)])  # fmt: skip

    def target(self, x: Column, u: Column, h: Expression) -> Column:
        return x + self.increment(x, u, h)

    def increment(self, x: Column, u: Column, h: Expression) -> Column:
        """x·(τ(hu) − e), n×1."""
        return self.moved(x, self.displacement(u, h))

    def rho(self, x: Column, h: Expression) -> SymbolicMatrix:
        """ρ(x) with columns h x·e_γ, n×m."""
        return h * sympy.Matrix.hstack(*(self.moved(x, e) for e in self.algebra.matrices))


class Attitude(RowAction):
    """The group acting on itself, N rows, for a scene on the group that goes with its attitude.

    Nothing depends on x there, so that rules for groups exist on it as those for actions do.
    """

    kinds = ("action", "group")


class UserAction(ActionGroupoid):
    """A right action given by its map right_action(x, g) on Rⁿ or on an open part of it."""

    fix = "; a right action has x·e = x and (x·g)·g′ = x·(gg′)"

    def __init__(
        self, algebra: MatrixAlgebra, retraction: Retraction, right_action: Function, dim_x: int
    ) -> None:
        super().__init__(algebra, retraction)
        if not callable(right_action) or type(dim_x) is not int or dim_x < 1:
            raise BadInput(
                "a right action needs its map and the dimension of its base: "
                "action(algebra, right_action=lambda x, g: ..., dim_x=n), n from 1."
            )
        if algebra.is_complex:
            raise BadInput(
                f"a right action on Rⁿ needs real matrices: give {algebra.name}.real, of twice the "
                "size, instead of the complex algebra."
            )
        self.right_action, self.dim_x, self.by_user = right_action, dim_x, True
        self.further = right_action, dim_x

    @property
    def name(self) -> str:
        label = getattr(self.right_action, "__name__", "map").strip("<>")
        return f"action({self.algebra.name}, {label}{self._chart})"

    @property
    def place(self) -> str:  # type: ignore[override]
        return line_of(self.right_action)

    def moved(self, x: Column, g: SymbolicMatrix) -> Column:
        return column_of(self.right_action, self.dim_x, f"{self.name}: its map", x, g)


def action(
    algebra: MatrixAlgebra,
    retraction: Retraction = cayley,
    rows: int = 1,
    *,
    right_action: Function | None = None,
    dim_x: int | None = None,
) -> ActionGroupoid:
    """The action groupoid of a matrix group on `rows` row vectors, x ↦ x·g, or by another action.

    right_action(x, g) takes a sympy column x (dim_x×1) and the matrix g (N×N) and returns x·g as
    dim_x expressions. The axioms are checked when the first scheme is built; `BadInput` says which
    law fails where.
    """
    if right_action is None and dim_x is None:
        return RowAction(algebra, retraction, rows)
    if rows != 1:
        raise BadInput("rows are for row vectors: a right action of one's own has dim_x instead.")
    return UserAction(algebra, retraction, right_action, dim_x)  # type: ignore[arg-type]
