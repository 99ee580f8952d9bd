"""What a one-step map sees of a scene: its vector field, energy and Poisson tensor on the dual.

Every answer is a column of letters, and the map's expressions stay small however often it asks:
what a letter stands for is kept in blocks, through which derivatives go (`chain_rule`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from ..errors import BadInput
from ..numbers import floats_exact, jacobian, replaced, sympy
from ..numbers.types import Column, Expression, Letter, SymbolicMatrix
from .chain_rule import Block, ChainRule, partials
from .continuous import closed_velocity, energy, momentum, rates
from .symbols import SceneSymbols, column, vector


@dataclass(eq=False)
class Point:
    """A state at which the map asks: letters of x, of μ and of ξ(x, μ), and what was answered."""

    x: Column
    mu: Column
    xi: Column
    answers: dict[str, Column] = field(default_factory=dict)


class DualSystem:
    """The scene as a one-step map sees it, on the dual algebroid with states z = (x, μ).

    n, m: the lengths of x and μ. parameters: the scene's, by name. groupoid: the scene's. Answers
    are letters of their own, so differentiating one by z gives nothing: ask `dH` for a gradient.
    """

    def __init__(self, s: SceneSymbols, unknowns: Sequence[Column] = ()) -> None:
        self._s, self.groupoid, self.parameters = s, s.groupoid, s.parameters
        self.n, self.m = len(s.x), len(s.mu)
        self.chain = ChainRule()
        #: columns of letters that expressions may hold
        self._columns = [s.x, s.mu, *unknowns]
        #: ξ at points where it has no closed form: unknowns of the step, and the rows they solve
        self.velocities: list[Column] = []
        self.velocity_rows: list[Column] = []
        self._points: dict[tuple[Expression, ...], Point] = {}

    # -- what a map may ask ----------------------------------------------------------------------

    def f(self, z: Column) -> Column:
        """The vector field (ẋ, μ̇) at z, (n+m)×1."""
        return self._answer("zf", z, self._rates)

    def xi(self, z: Column) -> Column:
        """The velocity ξ = ∂H/∂μ at z, m×1."""
        return self._at(z).xi

    def H(self, z: Column) -> Expression:
        """The energy ⟨μ, ξ⟩ − l(x, ξ) at z."""
        at, slope = self._at(z), self.dH(z)
        if "zh" not in at.answers:
            value = column([replaced([energy(self._s)], self._letters(at))[0]])
            by = [(at.x, slope[: self.n, :].T), (at.mu, slope[self.n :, :].T)]
            self._named(at, "zh", value, [part for part in by if len(part[0])])
        return at.answers["zh"][0]

    def dH(self, z: Column) -> Column:
        """The gradient (∂H/∂x, ∂H/∂μ) of the energy at z, (n+m)×1; the second part is ξ."""
        return self._answer("zg", z, self._force).col_join(self._at(z).xi)

    def B(self, z: Column) -> SymbolicMatrix:
        """The Poisson tensor at z, (n+m)×(n+m): the vector field is B dH.

        {xⁱ, μ_γ} = ρ̂ⁱ_γ, {μ_γ, μ_ν} = −Ĉ^θ_{γν} μ_θ.
        """
        s, at = self._s, self._at(z)
        rho = self.groupoid.rho(at.x, s.h) / s.h
        bracket = sympy.zeros(self.m)
        for nu, c in enumerate(self.groupoid.structure_functions(at.x, s.h)):
            bracket -= (c / s.h) * at.mu[nu]
        top = sympy.zeros(self.n).row_join(rho)
        return top.col_join((-rho.T).row_join(bracket)).applyfunc(sympy.sympify)

    def split(self, z: Column) -> tuple[Column, Column]:
        """(x, μ) of a state, n×1 and m×1."""
        self._check(z)
        return z[: self.n, :], z[self.n :, :]

    def join(self, x: Column, mu: Column) -> Column:
        """The state (x, μ), (n+m)×1."""
        return column([*x, *mu])

    def constant(self, value: Callable[[int], Any]) -> Letter:
        """A letter for an exact number, given as a function digits → mpf."""
        return self._s.constant(value)

    def chart_velocity(self, sigma: Column, xi: Column) -> Column:
        """σ̇ with d/dt τ(σ) = τ(σ) ξ in the chart of a group, m×1."""
        at = self._named_values("zs", sigma)
        return self.groupoid.L(self._s.x, at, sympy.Integer(1)) * xi

    def coadjoint(self, sigma: Column, mu: Column) -> Column:
        """Ad*_{τ(σ)} μ of a group, m×1: what μ becomes when g = τ(σ) is the motion."""
        at = self._named_values("zs", sigma)
        right = self.groupoid.tau.inverse_right_field(self.groupoid.algebra, at)  # type: ignore[attr-defined]
        return (right * self.groupoid.L(self._s.x, at, sympy.Integer(1))).T * mu

    @cached_property
    def degree(self) -> int | None:
        """The degree of H as a polynomial in z; None where it is none."""
        xi = closed_velocity(self._s)
        if xi is None:
            return None
        swap = dict(zip(self._s.u, xi, strict=True))
        letters = [*self._s.x, *self._s.mu]
        value = energy(self._s).xreplace(swap)
        if not value.is_polynomial(*letters):
            return None
        return int(sympy.Poly(value, *letters).total_degree())

    # -- letters ---------------------------------------------------------------------------------

    def _check(self, z: Any) -> None:
        shape = getattr(z, "shape", None)
        if shape != (self.n + self.m, 1):
            given = f"a {shape[0]}×{shape[1]} matrix" if shape and len(shape) == 2 else repr(z)
            raise BadInput(f"the map asks at {given}, but a state has {self.n + self.m} entries.")

    def _at(self, z: Column) -> Point:
        self._check(z)
        values = tuple(map(floats_exact, z))
        if values not in self._points:
            s = self._s
            given = column(values)
            if values != (*s.x, *s.mu):
                given = self._named_values("za", given)
            x, mu = given[: self.n, :], given[self.n :, :]
            xi = closed_velocity(s)
            if xi is None:
                xi = vector(f"zv{len(self.velocities)}", self.m)
                self._columns.append(xi)
                self.velocities.append(xi)
                at = Point(x, mu, xi)
                self.velocity_rows.append(column(replaced(momentum(s), self._letters(at))) - mu)
            else:
                swap = dict(zip([*s.x, *s.mu], given, strict=True))
                xi = self._named_values("zv", column(replaced(xi, swap)))
            self._points[values] = Point(x, mu, xi)
        return self._points[values]

    def _answer(self, name: str, z: Column, value: Callable[[Point], Column]) -> Column:
        at = self._at(z)
        if name not in at.answers:
            self._named(at, name, value(at))
        return at.answers[name]

    def _rates(self, at: Point) -> Column:
        return column(replaced(rates(self._s), self._letters(at)))

    def _force(self, at: Point) -> Column:
        """∂H/∂x = −∂l/∂x, n×1."""
        slope = jacobian([self._s.lagrangian], self._s.x)
        return -column(replaced(slope, self._letters(at)))

    def _letters(self, at: Point) -> dict[Expression, Expression]:
        s = self._s
        return dict(zip([*s.x, *s.u, *s.mu], [*at.x, *at.xi, *at.mu], strict=True))

    def _named(self, at: Point, name: str, values: Column, by: Any = None) -> None:
        at.answers[name] = self._named_values(name, values, by)

    def _named_values(self, name: str, values: Column, by: Any = None) -> Column:
        """Letters for the values; by: their derivatives, where these are known."""
        letters = vector(f"{name}{len(self.chain.blocks)}", len(values))
        if len(values):
            slopes = partials(values, self._columns) if by is None else by
            self.chain.add(Block(letters, values, slopes, summed=True))
            self._columns.append(letters)
        return letters
