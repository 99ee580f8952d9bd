"""Steps under constraints: discrete Lagrange–d'Alembert, with a multiplier at both ends.

    F⁻(x, u)/h = μ + h/2 B(x)ᵀλ,    μ′ = F⁺(x, u)/h + h/2 B(y)ᵀν,    A(y) ξ(y, μ′) = a(y)

with φ(y) = 0, A = φ′ρ̂ and a = −∂φ/∂t of positions (Marsden, West 2001, 3.5: SHAKE and RATTLE on
pairs), and Σ ω_i (A(x_i) u − a(x_i)) = 0 over the points where the rule asks for L, with its
weights, of rows for the velocity (Iglesias, Marrero, Martín de Diego, Martínez 2008). The time is
an entry of x and of y: a is evaluated at the times of the rule's points. B = A but for kinds of
constraints with other reactions. λ belongs to the start of the step, ν to its end: the momentum
that a step leaves admits the constraint itself.

The unknowns are the impulses hλ/2 and hν/2: round-off of a place moves these by ε/h, λ by ε/h².
A step so is a map on (x, μ); u, both impulses and the velocity at the end are solved for together.
"""

from __future__ import annotations

from ..errors import BadInput, CannotMeasure
from ..numbers import evaluate_matrix, null_direction, shown, sympy, to_sympy
from ..numbers.types import Expression
from ..rules import Discretisation
from ..scene import Scene
from .absolute_terms import absolute_terms
from .checks import named, singular
from .constraints import (
    constraint,
    constraint_matrix,
    constraint_shift,
    met_by_velocity,
    reaction_matrix,
)
from .continuous import mass_matrix
from .step_equations import DiscreteEquations, StepEquations
from .symbols import SceneSymbols, column, vector

#: share of the sum of an entry's terms: round-off of numbers of 30 digits
NONE = 1e-20


class ConstrainedEquations(StepEquations):
    """The equations of a rule's step on a scene with constraints, in the form of a one-step map.

    free: the equations without the constraints, if they are derived already; multipliers: hλ/2,
    behind u in w. Raises `CannotMeasure` for a rule with stages, or one that
    evaluates L at other points than those of the straight step.
    """

    free: DiscreteEquations

    def __init__(
        self, s: SceneSymbols, rule: Discretisation, free: DiscreteEquations | None = None
    ) -> None:
        super().__init__(s, rule)
        self.free = DiscreteEquations(s, rule) if free is None else free
        self.discrete = self.free.discrete
        of, maps = self.discrete.of, self.discrete
        self.of, self.scope = of, of.scope
        #: (weight, letters of the point) of each evaluation of L in the rule
        self.asked = [
            (weight, column(map(of.resolved, call.args[: len(s.x)]))) for weight, call in of.asked
        ]
        self._check_rule()
        y = of.point_of_step(sympy.Integer(1)).letters if len(s.x) else s.y
        graph, k = of.graph, reaction_matrix(s, s.x).rows
        self.multipliers, nu = vector("la", k), vector("nu", k)
        end = vector("ve", len(s.u))
        at_end = [*graph.letters(y), *(velocity := graph.letters(end))]
        leaving, arriving = (
            graph.transposed(graph.matrix(reaction_matrix(s, x)), graph.letters(impulse), len(end))
            for x, impulse in ((s.x, self.multipliers), (y, nu))
        )
        value = graph.read(s.lagrangian, dict(zip([*s.x, *s.u], at_end, strict=True)))
        (momentum,) = self.scope.jacobian([value], velocity)
        moved = graph.times(graph.matrix(constraint_matrix(s, y)), velocity)
        met = [graph.divided(e, of.h) for e in graph.column(constraint(s, y))]
        self.rows = [
            *graph.minus(maps.rows, leaving, graph.letters(s.mu)),
            *met, *graph.column(met_by_velocity(s, self.asked)),
            *graph.minus(momentum, maps.plus_of_rows, arriving),
            *graph.minus(moved, graph.column(constraint_shift(s, y))),
        ]  # fmt: skip
        self.unknowns = [("velocity", s.u), ("multiplier", self.multipliers), ("velocity", end),
                         ("impulse", nu)]  # fmt: skip
        gain = graph.plus(maps.gain_of_rows, leaving, arriving)
        self.increment = [*maps.increment, *gain]

    @property
    def symmetric(self) -> bool:
        """True if a step meets the constraints in the same way from both of its ends."""
        thetas: dict[Expression, Expression] = {}
        for weight, point in self.asked:
            block = next((b for b in self.of.points if b.letters == point), None)
            theta = sympy.Integer(0) if block is None else block.theta
            thetas[theta] = thetas.get(theta, 0) + weight
        # positions restrict both ends of a step alike
        met = met_by_velocity(self.s, [(self.h, self.x)])
        still = not met.free_symbols & set(self.x)
        return still or all(thetas.get(1 - theta) == weight for theta, weight in thetas.items())

    @property
    def adjoint(self) -> ConstrainedEquations:
        """The equations of the adjoint rule under the same constraints."""
        return ConstrainedEquations(self.s.for_another_rule(), self.free.adjoint.rule)

    def _check_rule(self) -> None:
        s, of = self.s, self.of
        known = [s.x, *(block.letters for block in of.points)]
        straight = all(
            point in known and tuple(call.args[len(s.x) :]) == tuple(s.u)
            for (_, point), (_, call) in zip(self.asked, of.asked, strict=True)
        )
        at = f"{self.s.name} with {self.rule.name}:"
        if not straight:
            raise CannotMeasure(
                f"{at} constraints need a rule without stages that asks for L at points of the "
                "straight step and with its velocity u; take midpoint or trapezoidal, or a "
                "composition of one that is its own adjoint."
            )
        if not self.asked:
            raise BadInput(
                f"{at} constraints need a weighted sum of values of L, which it is not: "
                f"{of.unweighted}"
            )
        total = sympy.expand(sum((weight for weight, _ in self.asked), sympy.Integer(0)))
        if total != self.h:
            raise BadInput(
                f"{at} the weights of L have the sum {total}, and under constraints it has to be "
                "h, exactly: write L(x, u)/6 and not 1/6*L(x, u), which is a float."
            )

    def check_regular(self, scene: Scene, rule: Discretisation) -> None:
        """Raise `BadInput` for redundant constraints, and if ∂²l/∂ξ² is singular everywhere.

        Redundant are those that follow from others, or vanish, at the start. Constraints may fix a
        velocity without mass, but μ does not determine it: then (x, μ) is no state.
        """
        s, name = self.s, scene.name
        for direction in singular({"": mass_matrix(s)}, s, s.x, s.u, scene).values():
            raise BadInput(
                f"{named(name, self.rule)}: the mass matrix ∂²l/∂ξ² is singular everywhere, in the "
                f"direction ({shown(direction)}) of ξ; every velocity needs its kinetic energy, "
                "those that constraints hold too: leave such a coordinate out, or give it a mass."
            )
        start = map(to_sympy, [*s.with_time(scene.x0), *scene.v0])
        at = dict(zip([*s.x, *s.u], start, strict=True))
        at |= s.exact_parameters(scene)
        symbolic = constraint_matrix(s, s.x)
        A, sizes = (
            evaluate_matrix(m.xreplace(at), 30)
            for m in (symbolic, symbolic.applyfunc(absolute_terms))
        )
        for i in range(A.rows):
            if all(abs(e) <= NONE * size for e, size in zip(A[i, :], sizes[i, :], strict=True)):
                raise BadInput(
                    f"{name}: constraint {i} has the row A = 0 at x0, so it restricts no velocity "
                    "there; leave it out, or begin elsewhere."
                )
        if A.rows > A.cols or null_direction(A.T, NONE) is not None:
            raise BadInput(
                f"{name}: the constraints are redundant: at x0 a row of A(x) follows from the "
                "others; leave it out."
            )
        if (B := reaction_matrix(s, s.x)) != symbolic:
            mass, B = (evaluate_matrix(m.xreplace(at), 30) for m in (mass_matrix(s), B))
            if null_direction(A * mass.LUsolve(B.T), NONE) is not None:
                raise BadInput(
                    f"{name}: the reactions of its constraints cannot hold them at x0: A M⁻¹Bᵀ is "
                    "singular there; give other reactions."
                )

    def refused(self, name: str) -> CannotMeasure:
        """Return the refusal of `name`, which only a map of arrows has."""
        reason = f"{self.s.name} has constraints"
        return CannotMeasure(f"{reason}: a step is a map on (x, μ) and has no {name} of arrows.")
