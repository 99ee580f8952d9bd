"""From one discrete Lagrangian to everything derived from it (paper, sections 2 and 3).

L_d is kept as a weighted sum of placed terms (`terms`), in letters for points and chart values. F⁻,
F⁺ and the equations of a step are small in these letters, and go to the kernels; the theory's
objects are written out in (x, u; h), as in the paper. Two facts keep expressions small, on every
groupoid:

    e→_γ(f∘β) = 0   and   e←_γ(f∘β) = ρ^i_γ(y) ∂f/∂y^i        (f a function of the base)

so the end point y = b(x, u; h) never has to be differentiated in F⁻ or F⁺: expressions that are
rational in a Cayley chart stay polynomial.

With stages a scheme is the system F⁻(x, u, s) = hμ, ∂L_d/∂s = 0. Objects on (x, u) alone (FL, W, Ω)
are Schur complements: s follows x and u.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from functools import cached_property

from ..numbers import Node, NodeMatrix, Scope, sympy
from ..numbers.types import Column, Expression, SymbolicMatrix
from ..rules import Discretisation
from .checks import check_letters
from .discrete_lagrangian import DiscreteLagrangian
from .on_group import Element
from .symbols import SceneSymbols, vector
from .terms import difference, gradient_along


class Arrows:
    """F⁻, F⁺, ρ, L, R of a scene and a rule of one step, and what the theory derives from them.

    of: the discrete Lagrangian if it is derived already; otherwise it is derived on first use.
    """

    def __init__(
        self, s: SceneSymbols, rule: Discretisation, of: DiscreteLagrangian | None = None
    ) -> None:
        self.s, self.rule, self.groupoid = s, rule, s.groupoid
        self._altered: dict[str, SymbolicMatrix] = {}
        if of is not None:
            self.of = of

    @cached_property
    def of(self) -> DiscreteLagrangian:
        """The discrete Lagrangian, as a weighted sum of placed terms."""
        lagrangian = DiscreteLagrangian(self.s, self.rule)
        check_letters(lagrangian, self.rule)
        return lagrangian

    def altered(self, **maps: SymbolicMatrix) -> Arrows:
        """Return these arrows with other matrices for some of minus, plus, gain, stage_equations
        and slope; the rest is derived anew."""
        other = Arrows(self.s, self.rule, self.of)
        other._altered = maps
        vars(other).update(maps)
        return other

    @property
    def element(self) -> Element | None:
        """The group element if L_d is a function of it."""
        return self.of.element if self.s.given is not None else None

    @cached_property
    def rho(self) -> SymbolicMatrix:
        """ρ(x), n×m."""
        return self.groupoid.rho(self.s.x, self.s.h)

    @cached_property
    def L(self) -> SymbolicMatrix:
        """L(x, u), m×m: its columns are the left-invariant fields."""
        return self.groupoid.L(self.s.x, self.s.u, self.s.h)

    @cached_property
    def R(self) -> SymbolicMatrix:
        """R(x, u), m×m: the fibre parts of the right-invariant fields."""
        return self.groupoid.R(self.s.x, self.s.u, self.s.h)

    @cached_property
    def L_at_translate(self) -> SymbolicMatrix:
        """L(x, u) at τ(hu) B, if L_d is given on the group (`Element.left`), m×m."""
        return self.L if self.element is None else self.element.left

    @cached_property
    def nodes(self) -> dict[str, list[Node]]:
        """F⁻, F⁺, F⁺ − F⁻ and ∂L_d/∂s; on the group polynomials in g, so that x·g − x·g cancels."""
        graph, columns = self.of.graph, self._derived()
        if self.element is not None:
            columns = {name: self._in_element(column) for name, column in columns.items()}
        changed = {name: e for name, e in self._altered.items() if name in columns}
        return columns | {name: graph.column(e) for name, e in changed.items()}

    def _in_element(self, nodes: Iterable[Node]) -> list[Node]:
        (g,) = self.of.moved
        return [self.of.graph.collected(e, g.nodes) for e in nodes]

    def _derived(self) -> dict[str, list[Node]]:
        of, graph = self.of, self.of.graph
        of_x, of_u, stages, of_moved = of.gradient()
        rho, L, R = map(graph.matrix, (self.rho, self.L, self.R))
        m = len(of_u)
        along_x = graph.plus(graph.transposed(rho, of_x, m), of.turned_x)
        minus = graph.minus(graph.transposed(R, of_u), along_x)
        plus = graph.plus(graph.transposed(L, of_u), of.turned_y)
        apart = difference(graph, L, R)
        gain = graph.plus(graph.transposed(apart, of_u), along_x, of.turned_y)
        for point, gradient in zip(of.moved, of_moved, strict=True):
            if not point.nodes:
                continue
            along = graph.transposed(point.anchor, gradient)
            fields = [*itertools.chain(*point.right)]
            varying = all(any(map(graph.slopes, e)) for e in (fields, gradient))
            if self.element is None and varying:  # it is used many times; g is used by its entries
                along = gradient_along(of.scope, point, gradient, "k", self.s.forced)
            right, left = (graph.transposed(e, along, m) for e in (point.right, point.left))
            minus, plus = graph.plus(minus, right), graph.plus(plus, left)
            apart = [graph.minus(b, a) for a, b in zip(point.right, point.left, strict=True)]
            gain = graph.plus(gain, graph.transposed(apart, along, m))
            if point.displacement is not None:
                force = of.force_at(point.nodes)
                right, left = (graph.transposed(e, force) for e in point.displacement)
                minus, plus = graph.plus(minus, right), graph.plus(plus, left)
                gain = graph.minus(graph.plus(gain, left), right)
        at_start = of.force_at(of.x)  # the start is displaced by −a
        minus, gain = graph.minus(minus, at_start), graph.plus(gain, at_start)
        return {"minus": minus, "plus": plus, "gain": gain, "stage_equations": stages}

    @cached_property
    def minus(self) -> Column:
        """F⁻, m×1."""
        return self._shown("minus")

    @cached_property
    def plus(self) -> Column:
        """F⁺, m×1."""
        return self._shown("plus")

    @cached_property
    def gain(self) -> Column:
        """F⁺ − F⁻ with common terms cancelled, m×1: recomputing F⁺ would let momenta drift."""
        return self._shown("gain")

    @cached_property
    def stage_equations(self) -> Column:
        """∂L_d/∂s, which vanish, k·m×1."""
        return self._shown("stage_equations")

    def _shown(self, name: str) -> Column:
        return self.of.graph.shown_column(self.nodes[name])

    @cached_property
    def system(self) -> Column:
        """E = (F⁻, ∂L_d/∂s): a step solves E = (hμ, 0) for w = (u, s)."""
        return self.minus.col_join(self.stage_equations)

    @cached_property
    def slope(self) -> SymbolicMatrix:
        """∂E/∂w, square."""
        return self.of.scope.total(self.system, [*self.s.u, *self.s.stages])

    @cached_property
    def rows(self) -> list[Node]:
        """E/h, in which powers of h cancel before they are ever rounded."""
        return self._per_step([*self.nodes["minus"], *self.nodes["stage_equations"]])

    @cached_property
    def slope_of_rows(self) -> NodeMatrix:
        """∂(E/h)/∂w, square; along e→, ∂F⁻/∂u · R, where L_d is given on the group."""
        of, graph = self.of, self.of.graph
        if self.element is not None:
            (g,) = of.moved
            slope = Scope(graph).jacobian(self.nodes["minus"], g.nodes)
            slope = [self._in_element(graph.transposed(g.right, row)) for row in slope]
        elif "slope" in self._altered:
            slope = graph.matrix(self.slope)
        else:
            return of.scope.jacobian(self.rows, [*of.u, *of.stages])
        return [self._per_step(row) for row in slope]

    @cached_property
    def plus_of_rows(self) -> list[Node]:
        """F⁺/h."""
        return self._per_step(self.nodes["plus"])

    @cached_property
    def gain_of_rows(self) -> list[Node]:
        """(F⁺ − F⁻)/h."""
        return self._per_step(self.nodes["gain"])

    def _per_step(self, nodes: Iterable[Node]) -> list[Node]:
        """Return nodes/h, term by term."""
        return [self.of.graph.divided(e, self.of.h) for e in nodes]

    @cached_property
    def target(self) -> Column:
        """y = b(x, u; h), n×1; x·g where L_d is given on the group."""
        s, element = self.s, self.element
        if element is None:
            return self.groupoid.target(s.x, s.u, s.h)
        return element.target(s.x, element.g, s.h)

    @cached_property
    def increment(self) -> list[Node]:
        """y − x with the difference cancelled, n entries."""
        s, graph = self.s, self.of.graph
        if self.element is None:
            return graph.column(self.groupoid.increment(s.x, s.u, s.h))
        x = graph.letters(s.x)
        return [graph.collected(e, x) for e in graph.minus(graph.column(self.target), x)]

    # -- the theory's objects, written out in (x, u; h) ------------------------------------------

    @cached_property
    def discrete_lagrangian(self) -> Expression:
        """L_d(x, u; h), or L_d(x, u, s; h) before the stages s are eliminated."""
        return self.written_out(sympy.Matrix([self.of.expression]))[0]

    @cached_property
    def legendre_minus(self) -> Column:
        """F⁻_γ = e→_γ(L_d), m×1 (paper, remark in section 2.5), with the part of a force."""
        return self.written_out(self.minus)

    @cached_property
    def legendre_plus(self) -> Column:
        """F⁺_γ = e←_γ(L_d), m×1 (paper, remark in section 2.5), with the part of a force."""
        return self.written_out(self.plus)

    @cached_property
    def residual(self) -> Column:
        """F⁺(x, u) − F⁻(b(x, u), v), m×1 in (x, u, v, h): λ of the paper's section 3.5.

        With stages also in s and r, the stages of this step and of the next.
        """
        s = self.s
        end = self.written_out(self.target)
        after = [*s.v, *end, *vector("r", len(s.stages))]
        pairs = zip([*s.u, *s.x, *s.stages], after, strict=True)
        return self.legendre_plus - self.legendre_minus.xreplace(dict(pairs))

    @cached_property
    def FL(self) -> SymbolicMatrix:
        """(FL)^γ_μ = −∂F⁻_μ/∂u^γ in row γ, column μ, m×m (paper, section 3.5).

        With stages it is the derivative along ∂L_d/∂s = 0, still written in (x, u, s). With a force
        it is that of the forced F⁻: FL decides whether a step is regular, and is not only L_d's.
        """
        stages = self.s.stages

        def by(column: Column, variable: Column) -> SymbolicMatrix:
            return self.written_out(self.of.scope.total(column, variable))

        slope = by(self.minus, self.s.u)
        if len(stages):
            equations = self.stage_equations
            slope -= by(self.minus, stages) * by(equations, stages).LUsolve(by(equations, self.s.u))
        return -slope.T

    @cached_property
    def W(self) -> SymbolicMatrix:
        """W_γμ = e←_μ(e→_γ(L_d)) = −L^θ_μ (FL)^θ_γ, m×m (paper, section 3.5).

        With a force it is e←_μ(F⁻_γ) of the forced F⁻, which is not a mixed derivative of L_d.
        """
        return -self.FL.T * self.L

    @cached_property
    def omega(self) -> SymbolicMatrix:
        """Ω on sections a^γ e→_γ + c^γ e←_γ in the order (a, c), 2m×2m: [[0, W], [−Wᵀ, 0]].

        With a force it is that of the forced F⁻, like W: then it is not closed, and no step need
        keep it.
        """
        zero = sympy.zeros(len(self.s.u))
        return sympy.BlockMatrix([[zero, self.W], [-self.W.T, zero]]).as_explicit()

    def written_out(self, matrix: SymbolicMatrix) -> SymbolicMatrix:
        """Return the matrix with every letter replaced by its value in (x, u, s; h).

        If L_d is given on the group, g = τ(hu): the translate is B = e.
        """
        written = self.of.graph.written_out(matrix)
        return written.xreplace(self.s.identity_translate)
