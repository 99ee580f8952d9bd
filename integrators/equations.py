"""From one discrete Lagrangian to everything that is derived from it (paper, sections 2 and 3).

L_d is kept as a function of (x, u) and of the *points* b(x, u; θh) that the rule asks for, each an
atom z with known derivatives. Two facts then keep every expression small, on every groupoid:

    e→_γ(f∘β) = 0   and   e←_γ(f∘β) = ρ^i_γ(y) ∂f/∂y^i        (f a function of the base)

so the end point y = b(x, u; h) never has to be differentiated in F⁻ or F⁺: what is rational in a
Cayley chart stays polynomial.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from .discretisations import Discretisation
from .errors import BadInput
from .evaluation import evaluate_matrix
from .exact import exact, floats_exact, to_sympy
from .groupoid import Groupoid, check_axioms
from .identities import first_violation, null_direction
from .scene import Scene
from .symbols import SceneSymbols

if TYPE_CHECKING:
    from .flow import Flow


@dataclass(frozen=True)
class Point:
    """The point at fraction `theta` of a step: an atom z for the expressions b(x, u; θh)."""

    theta: Any
    z: Any
    value: Any

    @property
    def is_end(self) -> bool:
        """Whether it is y = b(x, u; h)."""
        return bool(self.theta == 1)


class _GroupoidForRule:
    """What a rule sees of the groupoid: the target, with its points kept as atoms."""

    def __init__(self, groupoid: Groupoid, s: SceneSymbols) -> None:
        self.groupoid, self.s = groupoid, s
        self.points: list[Point] = []

    def target(self, x: Any, u: Any, h: Any) -> Any:
        h = floats_exact(h)
        theta = h / self.s.h
        if not self.groupoid.dim_x or theta == 0:
            return x
        if x != self.s.x or u != self.s.u or not theta.is_number:
            return self.groupoid.target(x, u, h)
        for point in self.points:
            if point.theta == theta:
                return point.z
        letter = "y" if theta == 1 else f"z{len(self.points)}"
        z = self.s.vector(letter, self.groupoid.dim_x)
        self.points.append(Point(theta, z, self.groupoid.target(x, u, h)))
        return z

    def element(self, u: Any, h: Any) -> Any:
        return self.groupoid.element(u, h)


class _LagrangianForRule:
    """What a rule sees of the Lagrangian: L(x, u) and L.parameters."""

    def __init__(self, s: SceneSymbols) -> None:
        self.s, self.parameters = s, s.parameters

    def __call__(self, x: Any, u: Any) -> Any:
        return self.s.lagrangian_at(x, u)


class Scheme:
    """A scene discretised by a rule: symbolic and exact.

    Attributes: x, u (columns n×1, m×1), y, v (those of the next step), h, and `s` with the
    parameters' symbols. Raises `BadInput` if the groupoid violates its axioms, the rule or the
    Lagrangian cannot be evaluated, or L_d is degenerate (FL singular everywhere).
    """

    def __init__(self, scene: Scene, rule: Discretisation) -> None:
        if not isinstance(scene, Scene):
            raise BadInput(f"{scene!r} is no scene: give a Scene, or scenes.get(name).")
        if not isinstance(rule, Discretisation):
            raise BadInput(f"{rule!r} is no rule: decorate the function with @discretisation().")
        check_axioms(scene.groupoid)
        self.scene, self.rule = scene, rule
        self.s = s = SceneSymbols(scene)
        self.x, self.u, self.y, self.v, self.h = s.x, s.u, s.y, s.v, s.h
        self._seen = _GroupoidForRule(scene.groupoid, s)
        if scene.discrete_lagrangian is not None:
            given = s.call(
                scene.discrete_lagrangian, "its discrete Lagrangian", s.x, s.u, s.h, s.parameters
            )
        else:
            s.lagrangian  # noqa: B018 - a wrong Lagrangian is named before the rule
            given = s.call(
                rule.formula, f"rule {rule.name}", _LagrangianForRule(s), self._seen, s.x, s.u, s.h
            )
        #: L_d with the points as atoms
        self.discrete_lagrangian_at_points = s.scalar(given, f"rule {rule.name}")
        self.points = tuple(self._seen.points)
        self._check_free_symbols()
        self.check_start(scene)
        self._check_regular()

    # -- the theory's objects, written out in (x, u; h) ----------------------------------------

    @cached_property
    def discrete_lagrangian(self) -> Any:
        """L_d(x, u; h)."""
        return self.written_out(self.discrete_lagrangian_at_points)

    @cached_property
    def rho(self) -> Any:
        """ρ(x), n×m."""
        return self.scene.groupoid.rho(self.x, self.h)

    @cached_property
    def L(self) -> Any:
        """L(x, u), m×m: columns are the left-invariant fields."""
        return self.scene.groupoid.L(self.x, self.u, self.h)

    @cached_property
    def R(self) -> Any:
        """R(x, u), m×m: columns are the fibre parts of the right-invariant fields."""
        return self.scene.groupoid.R(self.x, self.u, self.h)

    @cached_property
    def legendre_minus(self) -> Any:
        """F⁻_γ = e→_γ(L_d), m×1 (paper, remark in section 2.5)."""
        return self.written_out(self.minus_at_points)

    @cached_property
    def legendre_plus(self) -> Any:
        """F⁺_γ = e←_γ(L_d), m×1 (paper, remark in section 2.5)."""
        return self.written_out(self.plus_at_points)

    @cached_property
    def residual(self) -> Any:
        """F⁺(x, u) − F⁻(b(x, u), v), m×1 in (x, u, v, h): λ of the paper's section 3.5."""
        groupoid = self.scene.groupoid
        end = groupoid.target(self.x, self.u, self.h)
        pairs = [*zip(self.u, self.v, strict=True), *zip(self.x, end, strict=True)]
        return self.legendre_plus - self.legendre_minus.subs(pairs, simultaneous=True)

    @cached_property
    def FL(self) -> Any:
        """(FL)^γ_μ = −∂F⁻_μ/∂u^γ in row γ, column μ, m×m (paper, section 3.5)."""
        return -self.written_out(self.total_u(self.minus_at_points)).T

    @cached_property
    def W(self) -> Any:
        """W_γμ = e←_μ(e→_γ(L_d)) = −L^θ_μ (FL)^θ_γ, m×m (paper, section 3.5)."""
        return -self.FL.T * self.L

    @cached_property
    def omega(self) -> Any:
        """Ω on sections a^γ e→_γ + c^γ e←_γ in the order (a, c), 2m×2m: [[0, W], [−Wᵀ, 0]]."""
        from sympy import BlockMatrix, zeros

        zero = zeros(len(self.u))
        return BlockMatrix([[zero, self.W], [-self.W.T, zero]]).as_explicit()

    @cached_property
    def self_adjoint(self) -> bool:
        """Whether Φ₋ₕ is the inverse of Φₕ, derived from the expressions.

        The adjoint has the discrete Lagrangian L_d*(g; h) = −L_d(g⁻¹; −h); the rule is self-adjoint
        iff L_d* and L_d have the same Legendre maps, that is, if they differ by a constant.
        """
        groupoid, x, u, h = self.scene.groupoid, self.x, self.u, self.h
        end, back = groupoid.target(x, u, h), -groupoid.inversion(x, u, h)
        pairs = [*zip(x, end, strict=True), *zip(u, back, strict=True), (h, -h)]
        adjoint = -self.discrete_lagrangian.subs(pairs, simultaneous=True)
        difference = adjoint - self.discrete_lagrangian
        gradient = [difference.diff(w) for w in (*x, *u)]
        return first_violation(gradient, small=(*u, h)) is None

    @cached_property
    def order(self) -> int | None:
        """The order in (x, μ) that this rule has on this scene; None if the rule states none.

        A self-adjoint method has even order (Hairer, Lubich, Wanner, II.3): so the rectangle rule
        gains one wherever it turns out self-adjoint, as on a group, where every rule is h·l(u).
        """
        order, groupoid = self.rule.order, self.scene.groupoid
        if order is not None and order > 1 and not groupoid.symmetric_chart:
            return 1  # u is not the velocity of the middle of the step
        if order is None or order % 2 == 0:
            return order
        return order + 1 if groupoid._inversion is not None and self.self_adjoint else order

    def flow(self, step: Any, digits: int = 16) -> Flow:
        """The flow at one step size; digits = 16 is compiled double precision, more is mpmath."""
        from .flow import Flow

        return Flow(self, step, digits)

    # -- with the points as atoms: small expressions, for the kernels -----------------------------

    @cached_property
    def minus_at_points(self) -> Any:
        """F⁻ with the points as atoms, m×1."""
        d_x, d_u, at_points = self._gradients
        result = self.R.T * d_u - self.rho.T * d_x
        for (_, d_z), (right, _) in zip(at_points, self._point_fields, strict=True):
            result += right.T * d_z
        return result

    @cached_property
    def plus_at_points(self) -> Any:
        """F⁺ with the points as atoms, m×1."""
        _, d_u, at_points = self._gradients
        result = self.L.T * d_u
        for (_, d_z), (_, left) in zip(at_points, self._point_fields, strict=True):
            result += left.T * d_z
        return result

    @cached_property
    def gain_at_points(self) -> Any:
        """F⁺ − F⁻ with what they share cancelled, m×1: recomputing F⁺ would let momenta drift."""
        d_x, d_u, at_points = self._gradients
        result = (self.L - self.R).applyfunc(lambda e: e.expand()).T * d_u + self.rho.T * d_x
        for (_, d_z), (right, left) in zip(at_points, self._point_fields, strict=True):
            result += (left - right).T * d_z
        return result

    def total_u(self, column: Any) -> Any:
        """d(column)/du through the points, k×m."""
        g, s = self.scene.groupoid, self.s
        result = column.jacobian(self.u)
        for point in self.points:
            inner = column.jacobian(point.z)
            if any(inner):
                result += inner * g.point_slope(s.x, s.u, s.h, point.theta, point.z)
        return result

    def total_x(self, column: Any) -> Any:
        """d(column)/dx through the points, k×n."""
        from sympy import zeros

        if not len(self.x):
            return zeros(len(column), 0)
        result = column.jacobian(self.x)
        for point in self.points:
            inner = column.jacobian(point.z)
            if any(inner):
                result += inner * point.value.jacobian(self.x)
        return result

    def written_out(self, expression: Any) -> Any:
        """The expression (or matrix) with every point replaced by its value in (x, u; h)."""
        pairs = {z: b for p in self.points for z, b in zip(p.z, p.value, strict=True)}
        return expression.xreplace(pairs) if pairs else expression

    @cached_property
    def _gradients(self) -> tuple[Any, Any, list[tuple[Point, Any]]]:
        """∂L_d/∂x, ∂L_d/∂u and, point by point, ∂L_d/∂z."""
        from sympy import Matrix

        f = self.discrete_lagrangian_at_points

        def gradient(variables: Any) -> Any:
            return Matrix(len(variables), 1, [f.diff(w) for w in variables])

        return gradient(self.x), gradient(self.u), [(p, gradient(p.z)) for p in self.points]

    @cached_property
    def _point_fields(self) -> list[tuple[Any, Any]]:
        """Per point: how e→ and e← move it, n×m each."""
        g, s = self.scene.groupoid, self.s
        return [g.point_fields(s.x, s.u, s.h, p.theta, p.z) for p in self.points]

    # -- checks ---------------------------------------------------------------------------------

    def _check_free_symbols(self) -> None:
        known = {*self.x, *self.u, *self.s.q, *(z for p in self.points for z in p.z)}
        unknown = self.discrete_lagrangian_at_points.free_symbols - known
        if unknown:
            raise BadInput(
                f"{self.scene.name} with {self.rule.name}: the discrete Lagrangian holds "
                f"the unknown symbol {min(map(str, unknown))}; write it with x, u, h, parameters."
            )
        if not self.discrete_lagrangian_at_points.free_symbols & set(self.u):
            raise BadInput(
                f"{self.scene.name} with {self.rule.name}: the discrete Lagrangian does not depend "
                "on u, so FL is singular everywhere; it needs a kinetic term."
            )

    def _check_regular(self) -> None:
        """Raise `BadInput` if FL is singular at every point: tried at two random ones."""
        from sympy import Matrix

        from .identities import random_point

        slopes = self.total_u(self.minus_at_points)
        for seed in range(2):
            point = random_point([*self.x, *self.u, *self.s.q], (*self.u, self.h), seed)
            for p, value in zip(self.s.parameter_list, self.s.parameter_values, strict=True):
                point[p] = to_sympy(value)
            at_points = {
                z: b.xreplace(point) for p in self.points for z, b in zip(p.z, p.value, strict=True)
            }
            found = Matrix(slopes.xreplace({**point, **at_points}))
            direction = null_direction(evaluate_matrix(found, 30))
            if direction is None:
                return
        shown = ", ".join(f"{float(e):.3g}" for e in direction)
        raise BadInput(
            f"{self.scene.name} with {self.rule.name}: FL is singular everywhere, in the direction "
            f"({shown}) of u; every velocity needs its kinetic energy."
        )

    def check_start(self, scene: Scene) -> None:
        """Raise `BadInput` unless the start satisfies every constraint (as |Γ|² = 1), exactly."""
        from sympy import Matrix, simplify

        s = self.s
        values = dict(zip(s.parameter_list, map(to_sympy, s.parameter_values), strict=True))
        x0 = Matrix(len(self.x), 1, [to_sympy(v) for v in scene.x0])
        v0 = Matrix(len(self.u), 1, [to_sympy(v) for v in scene.v0])
        at_start = dict(zip([*self.x, *self.u], [*x0, *v0], strict=True))
        for quantity in scene.symmetries:
            if quantity.value is None:
                continue
            found = s.scalar(quantity.formula(x0, s.mu, s.parameters), quantity.name)
            if found.free_symbols & set(s.mu):
                if scene.lagrangian is None:
                    continue  # the start's momentum is only given with the run
                mu0 = [s.lagrangian.diff(v).xreplace(at_start) for v in self.u]
                found = found.xreplace(dict(zip(s.mu, mu0, strict=True)))
            found, wanted = found.xreplace(values), to_sympy(exact(quantity.value, quantity.name))
            if simplify(found - wanted) != 0:
                raise BadInput(
                    f"{scene.name}: {quantity.name} is {_beside(found, wanted)} at x0, but must be "
                    f"{wanted}; change x0 (an exact value: fractions such as 2/7, 3/7, 6/7)."
                )


def _beside(found: Any, wanted: Any) -> str:
    """A number, told apart from the one it should be."""
    difference = float(found - wanted)
    return f"{float(found):.6g}" if abs(difference) > 1e-4 else f"{wanted} {difference:+.2g}"
