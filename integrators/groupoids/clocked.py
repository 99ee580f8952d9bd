"""A groupoid with the time beside its base: for Lagrangians and forces that depend on it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

from ..numbers import sympy
from ..numbers.types import Column, Expression, FieldPair, Letter, SymbolicMatrix
from .groupoid import Groupoid, Motion


def clock() -> Letter:
    """Return the letter of the time, which no parameter has (`equations.symbols`)."""
    return sympy.Symbol("ti0", real=True)


class Clocked(Groupoid):
    """The arrows of `inner` over (x, t): the target of (x, t, w; h) has the time t + θh, w = θu.

    θ is read from w: on a curve w(u, s) in the chart it is the slope by u at the identity; an
    expression of stages alone is a velocity, and θ is its slope by all of these together. No
    displacement moves the time, so e→ and e← are those of `inner`. stages: a letter of each stage's
    first entry.
    """

    by_user = False

    def __init__(self, inner: Groupoid, stages: Sequence[Letter] = ()) -> None:
        self.stages = tuple(stages)
        self.inner, self.kind, self.retraction = inner, inner.kind, inner.retraction
        self.canonical, self.by_maps = inner.canonical, inner.by_maps
        self.dim_x, self.dim_u = inner.dim_x + 1, inner.dim_u
        #: the algebra of the chart of `inner`, or None
        self.algebra = getattr(inner, "algebra", None)

    @property
    def name(self) -> str:
        return self.inner.name

    @cached_property
    def symbols(self) -> dict[str, Column | Letter]:
        """The letters of the groupoid; the time has the same one on every groupoid."""
        own = super().symbols
        return {**own, "x": own["x"][:-1, :].col_join(sympy.Matrix([clock()]))}

    def share(self, w: Column) -> Expression:
        """Return θ of a chart value w(u, s) = θu + …, or θ₁s₁ + θ₂s₂ + … of stages alone."""
        u = [*self.symbols["u"]]
        along = self.stages if w.free_symbols.isdisjoint(u) else u[:1]
        slope = sympy.Add(*(w[0].diff(letter) for letter in along))
        return slope.xreplace(dict.fromkeys(slope.free_symbols & {*u, *along}, 0))

    def target(self, x: Column, u: Column, h: Expression) -> Column:
        """Return (b, t + θh)."""
        return self._of("target", x, u, h).col_join(sympy.Matrix([x[-1] + h * self.share(u)]))

    def _of(self, what: str, x: Column, *rest: Column | Expression) -> Any:
        return getattr(self.inner, what)(x[:-1, :], *rest)

    def _with_row(self, matrix: SymbolicMatrix) -> SymbolicMatrix:
        """Return the matrix with a zero row below: nothing moves the time."""
        return matrix.col_join(sympy.zeros(1, matrix.cols))

    def product(self, x: Column, u: Column, v: Column, h: Expression) -> Column:
        return self._of("product", x, u, v, h)

    def element(self, u: Column, h: Expression) -> SymbolicMatrix:
        return self.inner.element(u, h)

    def inverse_left(self, x: Column, w: Column, h: Expression) -> SymbolicMatrix:
        return self._of("inverse_left", x, w, h)

    def rho(self, x: Column, h: Expression) -> SymbolicMatrix:
        return self._with_row(self._of("rho", x, h))

    def L(self, x: Column, u: Column, h: Expression) -> SymbolicMatrix:
        return self._of("L", x, u, h)

    def R(self, x: Column, v: Column, h: Expression) -> SymbolicMatrix:
        return self._of("R", x, v, h)

    def structure_functions(self, x: Column, h: Expression) -> list[SymbolicMatrix]:
        functions: list[SymbolicMatrix] = self._of("structure_functions", x, h)
        return functions

    def group_parts(self, x: Column, u: Column, h: Expression) -> list[tuple[Groupoid, Column]]:
        parts: list[tuple[Groupoid, Column]] = self._of("group_parts", x, u, h)
        return parts

    def inversion(self, x: Column, u: Column, h: Expression) -> Column:
        return self._of("inversion", x, u, h)

    @property
    def _inversion(self) -> Column | None:
        return self.inner._inversion

    def increment(self, x: Column, u: Column, h: Expression) -> Column:
        """Return (b − x, θh)."""
        return self._of("increment", x, u, h).col_join(sympy.Matrix([h * self.share(u)]))

    def point_motion(
        self, x: Column, u: Column, h: Expression, theta: Expression, z: Column
    ) -> Motion:
        inner: Motion = self._of("point_motion", x, u, h, theta, z[:-1, :])
        return inner._replace(anchor=self._with_row(inner.anchor))

    def displacement_at(self, x: Column, u: Column, h: Expression, theta: Expression) -> FieldPair:
        pair: FieldPair = self._of("displacement_at", x, u, h, theta)
        return pair
