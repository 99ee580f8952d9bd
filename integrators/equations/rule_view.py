"""The groupoid and the Lagrangian as arguments of a rule.

G.target, G.velocity and L return functions that know their values: a rule may differentiate them,
replace letters in them or expand them. If they stay unchanged, the scheme recognises them and
derives each term once. Other uses of an expression (coefficients, arguments, bound letters) are
right too: a user's rule is called once more with everything written out, and if the two differ the
latter is derived (`value_of_rule`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from inspect import unwrap
from types import SimpleNamespace
from typing import Any

from ..errors import BadInput, CannotMeasure, line_of
from ..numbers import first_violation, floats_exact, jacobian, sympy
from ..numbers.types import Column, Expression, Expressions, Letter, SymbolicMatrix
from ..rules import Discretisation
from .symbols import SceneSymbols, column


def answer(name: str, value: Callable[..., Expression]) -> Any:
    """Return a class of sympy functions whose applications stand for value(*arguments)."""

    def written_out(self: Expression) -> Expression:
        return value(*self.args)

    def derivative(self: Expression, s: Letter) -> Expression:
        return written_out(self).diff(s)

    members = {
        "written_out": written_out,
        "_eval_derivative": derivative,
        "_eval_is_real": lambda self: True,
        # rules that look into an expression call expand()
        "_eval_expand_basic": lambda self, **hints: written_out(self),
    }
    return type(name, (sympy.Function,), members)


class GroupoidForRule:
    """The groupoid for a rule: targets and velocities, elements and the inversion.

    written: True to return the expressions themselves.
    """

    offers = "G has target, velocity, element, inversion, constant"

    def __init__(self, s: SceneSymbols, written: bool = False) -> None:
        self.groupoid, self.s, self.written = s.groupoid, s, written
        n, m = s.groupoid.dim_x, s.groupoid.dim_u

        def target(i: Expression, *a: Expression) -> Expression:
            return s.groupoid.target(column(a[:n]), column(a[n:-1]), a[-1])[int(i)]

        def velocity(i: Expression, *a: Expression) -> Expression:
            x, w, dw = (column(part) for part in (a[:n], a[n : n + m], a[n + m : -1]))
            return (s.groupoid.inverse_left(x, w, a[-1]) * dw)[int(i)]

        self.Target, self.Velocity = answer("target", target), answer("velocity", velocity)
        #: the matrix τ(hu); ι(x, u; h) of (x, u)⁻¹ = (b, ι); a letter for an exact number, given as
        #: a function digits → mpf
        self.element, self.inversion = s.groupoid.element, s.groupoid.inversion
        self.constant = s.constant
        #: True if the rule takes velocities from curves, and so serves every chart alike
        self.gave_velocities = False

    def target(self, x: Column, u: Column, h: Expression) -> Column:
        """Return b(x, u; h), n×1; u may be any value w(u, s) of a curve in the chart."""
        self._check((x, self.groupoid.dim_x, "x"), (u, self.groupoid.dim_u, "u"))
        h, s = floats_exact(h), self.s
        if s.clocked and h != s.h and all(u.free_symbols & {*e} for e in (s.u, s.stages)):
            raise BadInput(
                f"the time of G.target(x, w, {h}) is unknown, for w holds u and stages: write a "
                f"value of a curve in the chart, with {s.h} for the step."
            )
        if not self.groupoid.dim_x or h == 0 or not any(u):
            return x
        return self._each(self.Target, self.groupoid.dim_x, *x, *u, h)

    def velocity(self, x: Column, w: Column, dw: Column, h: Expression) -> Column:
        """Return ξ = L(x, w; h)⁻¹ dw/dθ at the chart value w of a curve w(θ), m×1."""
        self.gave_velocities = True
        m = self.groupoid.dim_u
        self._check((x, self.groupoid.dim_x, "x"), (w, m, "w"), (dw, m, "dw"))
        if self.groupoid.left_is_identity or not any(w):
            return dw.applyfunc(floats_exact)
        return self._each(self.Velocity, len(dw), *x, *w, *dw, h)

    def _check(self, *arguments: tuple[Column, int, str]) -> None:
        for entries, length, name in arguments:
            if len(entries) != length:
                raise BadInput(
                    f"the rule asks {self.groupoid.name} with {len(entries)} entries for {name}, "
                    f"but {length} are needed."
                )

    def _each(self, kind: type, length: int, *arguments: Expression) -> Column:
        expressions = [floats_exact(a) for a in arguments]
        answers = (kind(i, *expressions) for i in range(length))
        return column(a.written_out() if self.written else a for a in answers)


class LagrangianForRule:
    """The Lagrangian for a rule: L(x, u), its parts at a point, and L.parameters.

    The parts are L.fast(x) and L.discrete(x, u, h), if the scene gives them, and on a pair groupoid
    L.potential(x), L.gradient(x), L.mass(x). written: True to return the expressions themselves.
    """

    offers = "L has L(x, u), potential, gradient, mass, fast, discrete, parameters"

    def __init__(self, s: SceneSymbols, written: bool = False) -> None:
        self.s, self.parameters, self.written = s, s.parameters, written
        #: the discrete Lagrangian that the scene gives itself, at an arrow (x, u; h)
        self.discrete = s.discrete_lagrangian_at
        n = len(s.x)
        self.Value = answer("lagrangian", lambda *a: s.lagrangian_at(column(a[:n]), column(a[n:])))
        self.Fast = answer("fast", lambda *a: s.fast_at(column(a)))

        self.Gradient = answer("gradient", lambda i, *x: self.part("gradient", column(x))[int(i)])
        self.Mass = answer("mass", lambda i, j, *x: self.part("mass", column(x))[int(i), int(j)])

    def __call__(self, x: Column, u: Column) -> Expression:
        if self.written or len(x) != len(self.s.x) or len(u) != len(self.s.u):
            return self.s.lagrangian_at(x, u)  # this raises the right error
        return self.Value(*x, *u)

    def fast(self, x: Column) -> Expression:
        """Return the fast part of the potential at x."""
        value = self.s.fast_at(x if self.written else self.s.x)  # raises if there is none
        return value if self.written else self.Fast(*x)

    def potential(self, x: Column) -> Expression:
        """Return V(x) = −l(x, 0), on a pair groupoid."""
        self._check("potential", x)
        return -self.s.lagrangian_at(x, 0 * self.s.u)

    def gradient(self, x: Column) -> Column:
        """Return ∂V/∂x at x, m×1, on a pair groupoid (for force gradients, as Takahashi, Imada)."""
        self._check("gradient", x)
        if self.written:
            return self.part("gradient", x)
        return column(self.Gradient(i, *x) for i in range(len(self.s.u)))

    def mass(self, x: Column) -> SymbolicMatrix:
        """Return ∂²l/∂u∂u at (x, 0), m×m, on a pair groupoid."""
        self._check("mass", x)
        mass = self.part("mass", x)
        if self.written or not mass.free_symbols & x.free_symbols:
            from .mass import Mass

            return Mass(mass)
        m = len(self.s.u)
        return sympy.Matrix(m, m, lambda i, j: self.Mass(i, j, *x) if mass[i, j] else 0)

    def part(self, name: str, x: Column) -> SymbolicMatrix:
        """Return the gradient of V or the mass at any column x, written out."""
        return self._parts[name].xreplace(dict(zip(self.s.x, x, strict=True)))

    @cached_property
    def _parts(self) -> dict[str, SymbolicMatrix]:
        s, still = self.s, dict.fromkeys(self.s.u, sympy.Integer(0))
        slope = jacobian([s.lagrangian], s.u).T
        return {
            "gradient": -jacobian([s.lagrangian.xreplace(still)], s.position).T,
            "mass": jacobian(list(slope), s.u).xreplace(still),
        }

    def _check(self, name: str, x: Column) -> None:
        s = self.s
        if not s.groupoid.canonical:
            raise BadInput(
                f"L.{name}(x) is in the coordinates of a pair groupoid, and {s.name} is on "
                f'{s.groupoid.name}: say groupoids="pair" of the rule, or build it from L(x, u).'
            )
        if len(x) != len(s.x):
            raise BadInput(f"L.{name} takes the {len(s.x)} entries of a point, not {len(x)}.")


def value_of_rule(rule: Discretisation, L: LagrangianForRule, G: GroupoidForRule) -> Expression:
    """Return the rule's value for the answers of L and G, if it only uses them; else written out.

    A rule of ours only uses them. A user's function may look into them, so it is called twice.
    """
    s = L.s

    def asked(L: LagrangianForRule, G: GroupoidForRule) -> Expression:
        stages = [s.stage_columns] if rule.stages else []
        return s.call(rule.formula, f"rule {rule.name}", L, G, s.x, s.u, s.h, *stages)

    if not line_of(unwrap(rule.formula)) and not line_of(s.given):
        return asked(L, G)
    plain = GroupoidForRule(s, written=True)
    wanted = asked(LagrangianForRule(s, written=True), plain)
    value, same = sympy.Integer(0), False
    try:
        value = asked(L, G)
        same = first_violation([written(value) - wanted], [*s.u, *s.stages, s.h]) is None
    except BadInput:  # it needs a property of an expression that an answer lacks
        G.gave_velocities = plain.gave_velocities
    except ZeroDivisionError:  # it is finite nowhere, which the next line reports
        pass
    s.scalars([value], f"rule {rule.name}", rule.formula)  # the rule's own, not L's or G's
    return value if same else wanted


def name_constants(rule: Discretisation, s: SceneSymbols) -> None:
    """Give letters to the constants of a rule of ours, without its expression."""
    none = 0 * s.u
    G = SimpleNamespace(constant=s.constant, target=lambda *z: none, velocity=lambda *z: none)
    rule.formula(lambda *z: 0, G, none, none, s.h, [none] * rule.stages)


def written(e: Expression) -> Expression:
    """Return the expression with every answer in it replaced by its value."""
    while answers := [a for a in e.atoms(sympy.Function) if hasattr(a, "written_out")]:
        e = e.xreplace({a: a.written_out() for a in answers})
    return e


def answers_of(args: Expressions, kind: type) -> Expressions | None:
    """Return the arguments after the index if they are entries 0, 1, … of one answer, or None."""
    if not args or not all(isinstance(a, kind) for a in args):
        return None
    rest = args[0].args[1:]
    whole = all(a.args == (i, *rest) for i, a in enumerate(args))
    return rest if whole else None


# Rules on a Hamiltonian whose Lagrangian has no closed form: momenta are unknowns of the step.
# l(x, v) is the stationary value of μ·v − H(x, μ) in μ (the Legendre transform). Each value of l in
# a rule adds one stage, that μ, and L_d is stationary in all of them (Leok, Zhang 2011, section 3,
# have this Hamilton–Pontryagin form): nothing else changes.


class _Stationary:
    """The Lagrangian for a rule: each value of it has the next of some columns as its μ.

    Without columns, the values are only counted (`asked`).
    """

    offers = "L of a Hamiltonian without a closed Lagrangian has L(x, u) and parameters"

    def __init__(self, s: SceneSymbols, columns: list[Column] | None = None) -> None:
        self.s, self.parameters, self.columns, self.asked = s, s.parameters, columns, 0

    def __call__(self, x: Column, u: Column) -> Expression:
        self.asked += 1
        if self.columns is None:
            return sympy.Integer(0)
        mu = self.columns[self.asked - 1]
        return mu.dot(u) - self.s.hamiltonian_at(x, mu)


def with_momenta(s: SceneSymbols, rule: Discretisation) -> Discretisation:
    """Return the rule with one more stage for each value of the Lagrangian in it.

    Raises `CannotMeasure` if it needs more than values.
    """
    counted = _Stationary(s)
    try:
        stages = [[0 * s.u] * rule.stages] if rule.stages else []
        rule.formula(counted, GroupoidForRule(s), s.x, s.u, s.h, *stages)
    except (AttributeError, BadInput) as error:
        raise CannotMeasure(
            f"{s.name}: {rule.name} asks for more than values of the Lagrangian ({error}), which "
            "is not known in closed form of its Hamiltonian; take another rule."
        ) from error
    own = rule.stages

    def formula(
        L: LagrangianForRule, G: GroupoidForRule, x: Column, u: Column, h: Letter, s: list[Column]
    ) -> Expression:
        own_stages = [s[:own]] if own else []
        return rule.formula(_Stationary(L.s, s[own:]), G, x, u, h, *own_stages)

    formula.__wrapped__ = rule.formula  # type: ignore[attr-defined]  # whose lines messages name
    return replace(rule, formula=formula, stages=own + counted.asked, nodes=None)
