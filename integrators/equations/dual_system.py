"""The vector field, energy and Poisson tensor of a scene on the dual, for one-step maps.

Every answer is a letter, so the map's expressions stay small however often it asks; the value of a
letter is held, and derivatives go through it (`numbers.held`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import TypeAlias, cast

from ..errors import BadInput, shown
from ..groupoids import RetractionGroupoid
from ..numbers import (
    Graph,
    Scope,
    first_violation,
    floats_exact,
    jacobian,
    parts_of,
    replaced,
    symbols_of,
    sympy,
)
from ..numbers.nodes import Nodes, Slopes
from ..numbers.types import Column, Expression, Expressions, Function, Letter, SymbolicMatrix
from ..scene import halves
from .continuous import (
    closed_velocity,
    energy,
    energy_gradient,
    inverse_two_form,
    momentum,
    poisson_tensor,
    rates,
)
from .symbols import SceneSymbols, column, vector

#: letters, each with the matrix of derivatives by them
Partials: TypeAlias = Iterable[tuple[Column, SymbolicMatrix]]

MOST_TERMS = 6  # terms of the series of a part's flow


@cache
def _answer() -> type:
    """Return the class of functions, without formulas, of a letter and its unknowns and states."""

    def derivative(self: Expression, s: Letter) -> Expression:
        raise BadInput(
            "it differentiates an answer of s, which has no formula; s.df is the derivative of "
            "s.f, s.dH that of s.H."
        )

    members = {"_eval_derivative": derivative, "_eval_is_real": lambda self: True}
    return type("answer", (sympy.Function,), members)


@dataclass(eq=False)
class Point:
    """A state at which the map evaluates: letters of x, of μ and of ξ(x, μ), and its answers."""

    x: Column
    mu: Column
    xi: Column
    answers: dict[str, Column] = field(default_factory=dict)


class DualSystem:
    """The scene for a one-step map, on the dual algebroid with states z = (x, μ).

    n, m: the lengths of x and μ; if the scene depends on the time, it is the last entry of x. For a
    degenerate Lagrangian ϑ(x)·v − H(x) the state is z = x, and m = 0. parameters: the scene's, by
    name. groupoid: the scene's. Answers have no formula: a map that differentiates one, or replaces
    a part of it, gets an error.
    """

    def __init__(self, s: SceneSymbols, unknowns: Sequence[Column] = ()) -> None:
        self._s, self.groupoid, self.parameters = s, s.groupoid, s.parameters
        #: a letter for an exact number, given as a function digits → mpf
        self.constant = s.constant
        #: μ of the state
        self._mu = s.mu[:0, :] if s.degenerate else s.mu
        self.n, self.m = len(s.x), len(self._mu)
        self.graph = Graph()
        self.scope = Scope(self.graph)
        self.graph.fixed = {e.index for e in self.graph.letters(s.q)}
        #: columns of letters that stand for nothing else
        self._given = [s.x, s.mu, *unknowns]
        #: each letter in an answer, as the map sees it
        self._seen: dict[Letter, Expression] = {}
        #: ξ at points where it has no closed form: unknowns of the step, and the rows they solve
        self.velocities: list[Column] = []
        self.velocity_rows: list[Column] = []
        self._points: dict[tuple[Expression, ...], Point] = {}
        self._charts: dict[tuple[Expression, ...], Column] = {}
        self._parts: dict[Function, list[Column]] = {}

    @property
    def places(self) -> list[Column]:
        """The states at which a map has asked, in letters of the graph."""
        return [column(values) for values in self._points]

    def f(self, z: Column) -> Column:
        """Return the vector field (ẋ, μ̇) at z, (n+m)×1."""
        return self._shown(self._field(self._at(z)))

    def df(self, z: Column) -> SymbolicMatrix:
        """Return the derivative of the vector field at z, (n+m)×(n+m).

        Raises `BadInput` if ξ(x, μ) has no closed form.
        """
        at = self._at(z)
        if self.velocities:
            raise BadInput("s.df needs a closed form of ξ(x, μ), which this scene has not.")
        return self._shown(self.scope.total(self._field(at), column([*at.x, *at.mu])))

    def xi(self, z: Column) -> Column:
        """Return the velocity ξ = ∂H/∂μ at z, m×1."""
        return self._shown(self._at(z).xi)

    def H(self, z: Column) -> Expression:
        """Return the energy ⟨μ, ξ⟩ − l(x, ξ) at z."""
        at = self._at(z)
        by = [(at.x, self._force(at).T), (at.mu, self._speed(at).T)]
        slopes = [part for part in by if len(part[0])]
        return self._shown(self._placed(at, "zh", lambda: [energy(self._s)], slopes))[0]

    def dH(self, z: Column) -> Column:
        """Return the gradient (∂H/∂x, ∂H/∂μ) of the energy at z, (n+m)×1; the second part is ξ."""
        at = self._at(z)
        return self._shown(self._force(at).col_join(self._speed(at)))

    def force(self, z: Column) -> Column:
        """Return the vector field minus B dH at z, (n+m)×1: the scene's force on μ, the time's rate
        1.

        It is 0 without a force and a time.
        """
        s, at = self._s, self._at(z)
        rates_of_x = [int(s.clocked and i == self.n - 1) for i in range(self.n)]
        if not s.forced:
            return column(map(sympy.Integer, [*rates_of_x, *[0] * self.m]))
        return self._shown(column([*rates_of_x, *self._placed(at, "zp", lambda: s.force)]))

    def B(self, z: Column) -> SymbolicMatrix:
        """Return the Poisson tensor at z, (n+m)×(n+m): the vector field is B dH + force.

        {xⁱ, μ_γ} = ρ̂ⁱ_γ, {μ_γ, μ_ν} = −Ĉ^θ_{γν} μ_θ; for a degenerate Lagrangian the inverse of
        dϑ.
        """
        s, at = self._s, self._at(z)
        if s.degenerate:
            entries = self._placed(at, "zb", lambda: list(inverse_two_form(s)))
            return self._shown(sympy.Matrix(self.n, self.n, list(entries)))
        return self._shown(poisson_tensor(s, at.x, at.mu))

    def theta(self, z: Column) -> Column:
        """Return ϑ at z = x of a degenerate Lagrangian, n×1; `BadInput` for another scene."""
        return self._shown(self._one_form(self._at(z)))

    def dtheta(self, z: Column) -> SymbolicMatrix:
        """Return ∂ϑ_i/∂x_j at z = x, n×n; raises as `theta` does."""
        at = self._at(z)
        self._one_form(at)
        s = self._s
        entries = self._placed(at, "zj", lambda: list(jacobian(s.one_form, s.x)))
        return self._shown(sympy.Matrix(self.n, self.n, list(entries)))

    @property
    def halves(self) -> tuple[list[int], list[int]]:
        """Return the places of x where ϑ has a component, and the other half, where it vanishes."""
        self._one_form(self._at(self._s.x))
        return halves(self._s.one_form)  # the map's refusal has seen that they are halves

    def flow(self, part: Function, z: Column, h: Expression) -> Column:
        """Return the flow from z of a part(x, mu, p) of H for the time h: its series in h, if that
        ends.

        Raises `BadInput` if more than `MOST_TERMS` terms are not zero.
        """
        start = self.letters(z)
        letters = column([*self._s.x, *self._s.mu])
        if tuple(start) != tuple(letters):
            start = self._named("za", start)
        swap = dict(zip(letters, start, strict=True))
        new, size = self._shown(start), sympy.Integer(1)
        for k, term in enumerate(self._series(part), 1):
            size = size * h / k
            new += size * self._shown(self._named("zt", column(replaced(term, swap))))
        return new

    def check_parts(self, parts: Sequence[Function]) -> None:
        """Raise `BadInput` unless the parts add up to H, except for a constant."""
        s = self._s
        if s.forced or s.clocked or s.degenerate:
            raise BadInput(
                f"{s.name} has a force, a time or a one-form, of which a splitting by parts knows "
                "nothing: take another method."
            )
        xi = closed_velocity(s)
        if xi is None:
            return
        H = energy(s).xreplace(dict(zip(s.u, xi, strict=True)))
        left = H - sum(self._part(e) for e in parts)
        states = [*s.x, *s.mu]
        if first_violation(jacobian([left], states)) is not None:
            text = str(sympy.simplify(left))
            text = text if len(text) <= 80 else f"{text[:80]} …"
            raise BadInput(
                f"the parts of the splitting do not add up to H of {s.name}: what is left is "
                f"{text}, which depends on the state."
            )

    def _part(self, part: Function) -> Expression:
        s = self._s
        expression = s.call(part, "a part of H", s.position, s.mu, s.parameters)
        s.refuse_unknown(column([expression]), {*s.x, *s.mu}, "a part of H", part, "x, mu and p")
        return expression

    def _series(self, part: Function) -> list[Column]:
        """Return the derivatives of z along the field of a part of H, up to the last non-zero."""
        s = self._s
        if part not in self._parts:
            states = [*s.x, *s.mu]
            slope = jacobian([self._part(part)], states).T
            field = poisson_tensor(s, s.x, s.mu) * slope
            series, term = list[Column](), field
            while first_violation(term) is not None:
                if len(series) == MOST_TERMS:
                    raise BadInput(
                        f"{s.name}: the flow of the part {str(self._part(part))[:60]} is no "
                        "polynomial of the time, so it is not known: split H otherwise, such as "
                        "into T(mu) and V(x), or write the map with @one_step."
                    )
                series.append(term)
                term = jacobian(list(term), states) * field
            self._parts[part] = series
        return self._parts[part]

    def split(self, z: Column) -> tuple[Column, Column]:
        """Return (x, μ) of a state, n×1 and m×1."""
        self._check(z)
        return z[: self.n, :], z[self.n :, :]

    def join(self, x: Column, mu: Column) -> Column:
        """Return the state (x, μ), (n+m)×1."""
        return column([*x, *mu])

    def act(self, x: Column, sigma: Column) -> Column:
        """Return x·τ(σ), n×1, on a group's groupoid or that of its action; the time stays."""
        place, clock = x[: self._s.n, :], x[self._s.n :, :]
        target = self._group.target(self.letters(place), self._chart(sigma), sympy.Integer(1))
        return self._shown(target).col_join(clock) if self._s.n else x

    def chart_velocity(self, sigma: Column, xi: Column) -> Column:
        """Return σ̇ with d/dt τ(σ) = τ(σ) ξ in the chart of a group, m×1."""
        left = self._group.L(self._s.position, self._chart(sigma), sympy.Integer(1))
        return self._shown(left) * xi

    def coadjoint(self, sigma: Column, mu: Column, inverse: bool = False) -> Column:
        """Return Ad*_{τ(σ)} μ of a group, m×1: the value of μ after the motion g = τ(σ).

        inverse: Ad*_{τ(σ)⁻¹} μ.
        """
        if mu.is_zero_matrix:
            return mu
        at, one, group = self._chart(sigma), sympy.Integer(1), self._group
        if inverse:
            left = group.tau.inverse_left_field(group.algebra, at)
            return self._shown(left * group.R(self._s.position, at, one)).T * mu
        right = group.tau.inverse_right_field(group.algebra, at)
        return self._shown(right * group.L(self._s.position, at, one)).T * mu

    @property
    def _group(self) -> RetractionGroupoid:
        """Return the groupoid without the time."""
        return cast(RetractionGroupoid, getattr(self.groupoid, "inner", self.groupoid))

    def _chart(self, sigma: Column) -> Column:
        """Return letters for coordinates in the chart of a group."""
        if self.groupoid.retraction is None:
            raise BadInput(f"it asks for a chart, and {self.groupoid.name} is of no group.")
        values = self.letters(sigma)
        if tuple(values) not in self._charts:
            self._charts[tuple(values)] = self._named("zs", values)
        return self._charts[tuple(values)]

    @cached_property
    def degree(self) -> int | None:
        """Return the degree of H as a polynomial in z, or None for another H."""
        xi = closed_velocity(self._s)
        if xi is None:
            return None
        swap = dict(zip(self._s.u, xi, strict=True))
        letters = [*self._s.x, *self._s.mu]
        value = energy(self._s).xreplace(swap)
        if not value.is_polynomial(*letters):
            return None
        return int(sympy.Poly(value, *letters).total_degree())

    def letters(self, entries: Iterable[Expression]) -> Column:
        """Return a map's expressions, with the letters that its answers stand for.

        Raises `BadInput` if the map replaced a part of an answer.
        """
        formulas = replaced(map(floats_exact, entries), {seen: e for e, seen in self._seen.items()})
        if any(isinstance(part, _answer()) for part in parts_of(formulas)):
            raise BadInput("it replaces letters in what s gave: ask s again, at the other state.")
        return column(formulas)

    def _shown(self, matrix: SymbolicMatrix) -> SymbolicMatrix:
        """Return the matrix for the map: its letters become answers, which know their letters."""
        for letter in symbols_of(matrix) - self._seen.keys():
            if self.graph.value_of(letter) is not None:
                self._seen[letter] = _answer()(letter, *sorted(self._bases(letter), key=str))
        return sympy.Matrix(*matrix.shape, replaced(map(sympy.sympify, matrix), self._seen))

    def _bases(self, letter: Letter) -> set[Letter]:
        """Return the letters of states and unknowns that a letter depends on."""
        pending, seen = {letter}, set[Letter]()
        while pending:
            seen |= pending
            values = (self.graph.value_of(e) for e in pending)
            pending = symbols_of(v for v in values if v is not None) - seen
        return seen & {e for part in self._given for e in part}

    def _check(self, z: Column) -> None:
        shape = getattr(z, "shape", None)
        if shape != (self.n + self.m, 1):
            place = f"a {shape[0]}×{shape[1]} matrix" if shape and len(shape) == 2 else shown(z)
            raise BadInput(f"the map asks at {place}, but a state has {self.n + self.m} entries.")

    def _at(self, z: Column) -> Point:
        self._check(z)
        state = self.letters(z)
        values = tuple(state)
        if values not in self._points:
            s = self._s
            if values != (*s.x, *self._mu):
                state = self._named("za", state)
            at = Point(state[: self.n, :], state[self.n :, :], s.u)
            closed = closed_velocity(s)
            if closed is None:
                at.xi = vector(f"zv{len(self.velocities)}", self.m)
                self._given.append(at.xi)
                self.velocities.append(at.xi)
                row = column(replaced(momentum(s), self._letters(at))) - at.mu
                self.velocity_rows.append(row)
            else:
                at.xi = self._named("zv", column(replaced(closed, self._letters(at))))
            self._points[values] = at
        return self._points[values]

    def _field(self, at: Point) -> Column:
        return self._placed(at, "zf", lambda: rates(self._s)[: self.n + self.m, :])

    def _force(self, at: Point) -> Column:
        """Return ∂H/∂x at a point, as letters, n×1."""
        return self._placed(at, "zg", lambda: energy_gradient(self._s)[0])

    def _speed(self, at: Point) -> Column:
        """Return ∂H/∂μ = ξ at a point, as letters, m×1."""
        return at.xi[: self.m, :]

    def _one_form(self, at: Point) -> Column:
        if not self._s.degenerate:
            raise BadInput(
                f"it asks for the one-form of {self._s.name}, which has none: its Lagrangian is "
                "not ϑ(x)·v − H(x), given by one_form= and hamiltonian=."
            )
        return self._placed(at, "zo", lambda: self._s.one_form)

    def _placed(
        self, at: Point, name: str, entries: Callable[[], Expressions], by: Partials | None = None
    ) -> Column:
        """Return letters for entries in (x, ξ, μ) at a point, the same for each call."""
        if name not in at.answers:
            values = column(replaced(entries(), self._letters(at)))
            at.answers[name] = self._named(name, values, by)
        return at.answers[name]

    def _letters(self, at: Point) -> dict[Expression, Expression]:
        s = self._s
        return dict(zip([*s.x, *s.u, *self._mu], [*at.x, *at.xi, *at.mu], strict=True))

    def _named(self, name: str, values: Column, by: Partials | None = None) -> Column:
        """Return letters for the values. by: their derivatives, where these are known."""
        letters = vector(f"{name}{self.graph.parts}", len(values))
        if len(values):
            graph = self.graph
            slopes: list[tuple[Nodes, Slopes]] | None = None if by is None else [
                (graph.letters(letters), graph.matrix(matrix)) for letters, matrix in by
            ]  # fmt: skip
            self.scope.group(list(letters), graph.column(values), slopes)
        return letters
