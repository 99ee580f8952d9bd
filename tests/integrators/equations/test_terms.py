"""Terms: derivatives through placed terms, and what a rule does by its own hand to answers."""

import pytest
import sympy
from sympy import Rational

from discmech.integrators import Scheme, discretisation, rules, scenes
from discmech.integrators.numbers import first_violation
from tests.objects import SCENES


@discretisation(stages=1)
def skew(L, G, x, u, h, s):
    """Not self-adjoint, with a stage: its adjoint asks for curves that begin at the end."""

    def node(theta):
        w, dw = theta * u + theta * (1 - theta) * s[0], u + (1 - 2 * theta) * s[0]
        return L(G.target(x, w, h), G.velocity(x, w, dw, h))

    return h * (3 * node(Rational(1, 3)) + node(1)) / 4


def scheme_of(scene, rule, adjoint):
    scheme = Scheme(SCENES[scene], skew if rule == "skew" else rules.get(rule))
    return scheme.adjoint if adjoint else scheme


@pytest.mark.parametrize("adjoint", [False, True])
@pytest.mark.parametrize(("scene", "rule"), [
    ("moving-mass", "trapezoidal"), ("moving-mass", "gauss-2"), ("affine-on-line", "midpoint"),
    ("rigid-body", "lobatto-3"), ("pendulum", "skew"), ("affine-group", "skew"),
    ("spring-pendulum", "imex"),
])  # fmt: skip
def test_derivatives_through_terms_are_those_of_what_is_written_out(scene, rule, adjoint):
    of = scheme_of(scene, rule, adjoint)
    maps, s = of.at_points, of.s
    small = [*s.u, *s.stages, s.h]
    for column in (maps.minus, maps.plus, maps.stage_equations):
        written = of.written_out(column)
        for variable in (s.x, s.u, s.stages):
            if len(column) and len(variable):
                through = of.written_out(maps.total(column, variable))
                assert first_violation(through - written.jacobian(variable), small) is None


def plain(rule):
    """The scheme of a rule on the pendulum, L_d written out in (x, u; h)."""
    return Scheme(scenes.get("pendulum"), rule).discrete_lagrangian


def agree(one, other):
    return first_violation([one - other]) is None


def test_a_target_is_differentiated_by_the_point_it_starts_from():
    """An expression in the point reached, differentiated by x: by the chain rule, not 0."""

    @discretisation()
    def by_hand(L, G, x, u, h):
        z = G.target(x, u, h / 2)
        return h * L(z, u) + h**3 * sympy.sin(z[0]).diff(x[0])

    @discretisation()
    def written(L, G, x, u, h):
        z = x + h * u / 2
        return h * L(z, u) + h**3 * sympy.cos(z[0])

    assert agree(plain(by_hand), plain(written))


def test_a_lagrangian_is_differentiated_and_expanded():
    """The Hessian of L at a point, and L looked into by expand."""

    @discretisation()
    def by_hand(L, G, x, u, h):
        value = L(G.target(x, u, h / 2), u)
        mass = sympy.hessian(L(x, u), list(u))[0]
        return h * value + h**3 * mass * u[0] ** 2 + h**3 * value.expand().coeff(u[0], 2)

    @discretisation()
    def written(L, G, x, u, h):
        inertia = L.parameters.mass * L.parameters.length**2
        return h * L(G.target(x, u, h / 2), u) + h**3 * inertia * (u[0] ** 2 + Rational(1, 2))

    assert agree(plain(by_hand), plain(written))


def test_a_point_moved_by_hand_is_another_point():
    """One component as it was reached, the other moved: derivatives by both are right."""

    @discretisation()
    def sideways(L, G, x, u, h):
        return h * L(G.target(x, u, h / 2) + h * sympy.Matrix([0, Rational(1, 10)]), u)

    of = Scheme(scenes.get("kepler"), sideways)
    for variable in (of.x, of.u):
        through = of.written_out(of.at_points.total(of.at_points.minus, variable))
        written = of.legendre_minus.jacobian(variable)
        assert first_violation(through - written, [*of.u, of.h]) is None


@pytest.mark.parametrize("root", [lambda z: sympy.sqrt(1 + z**2), lambda z: sympy.sqrt(z + 9)])
def test_a_root_of_a_component_is_right(root):
    @discretisation()
    def by_hand(L, G, x, u, h):
        return h * L(x, u) + h**3 * root(G.target(x, u, h)[0])

    of = Scheme(scenes.get("pendulum"), by_hand)
    x, u, h = of.x[0], of.u[0], of.h
    wanted = of.discrete_lagrangian.diff(u)  # on pairs e→ is ∂/∂u − h ∂/∂x
    wanted -= h * of.discrete_lagrangian.diff(x)
    assert first_violation([of.legendre_minus[0] - wanted], [u, h]) is None


def test_letters_replaced_in_an_answer_are_replaced_in_what_it_stands_for():
    @discretisation()
    def by_hand(L, G, x, u, h):
        z = G.target(x, u, h)
        return h * (L(x, u) + L(z, u).subs(h, 0)) / 2

    assert agree(plain(by_hand), plain(rules.get("rectangle")))


def test_what_is_no_weighted_sum_of_values_is_derived_as_it_stands():
    @discretisation()
    def product(L, G, x, u, h):
        one, other = L(x, u), L(G.target(x, u, h), u)
        return h * (one + other) / 2 + h**3 * one * other

    of = Scheme(scenes.get("pendulum"), product)
    x, u, h = of.x[0], of.u[0], of.h
    value = of.discrete_lagrangian
    wanted = value.diff(u) - h * value.diff(x)
    assert first_violation([of.legendre_minus[0] - wanted], [u, h]) is None


def test_a_polynomial_is_made_of_what_an_answer_stands_for():
    @discretisation()
    def by_hand(L, G, x, u, h):
        kinetic = sympy.Poly(L(x, u), u[0]).coeff_monomial(u[0] ** 2) * u[0] ** 2
        return h * L(x, u) + h**3 * kinetic

    @discretisation()
    def written(L, G, x, u, h):
        inertia = L.parameters.mass * L.parameters.length**2
        return h * L(x, u) + h**3 * inertia * u[0] ** 2 / 2

    assert agree(plain(by_hand), plain(written))
