"""Terms: derivatives through placed terms, and what a rule does by its own hand to answers."""

import pytest
import sympy
from sympy import Rational

from discmech.integrators import (
    BadInput,
    MatrixAlgebra,
    Scene,
    Scheme,
    action,
    discretisation,
    pair,
    product,
    rules,
    scenes,
    se,
)  # fmt: skip
from discmech.integrators.numbers import arithmetic, evaluate_at, first_violation, random_point
from tests.objects import SCENES


@discretisation(stages=1)
def skew(L, G, x, u, h, s):
    """Not self-adjoint, with a stage: its adjoint asks for curves that begin at the end."""

    def node(theta):
        w, dw = theta * u + theta * (1 - theta) * s[0], u + (1 - 2 * theta) * s[0]
        return L(G.target(x, w, h), G.velocity(x, w, dw, h))

    return h * (3 * node(Rational(1, 3)) + node(1)) / 4


def attitude(x, v, p):
    """The potential is quadratic in the attitude, the mass of the carriage depends on it."""
    bent = sum((k + 1) * e**2 for k, e in enumerate(x)) + x[0] * x[-1]
    return sum((k + 2) * e**2 for k, e in enumerate(v)) * (1 + x[1] ** 2) / 2 - bent**2 / 4


SKEWED = MatrixAlgebra("so(3), skewed", [  # each bracket is a sum of several elements of the basis
    [[0, 0, 1], [0, 0, -2], [-1, 2, 0]],
    [[0, -1, 1], [1, 0, 0], [-1, 0, 0]],
    [[0, -1, 0], [1, 0, -3], [0, 3, 0]],
])  # fmt: skip
#: points of more coordinates than they have directions to move in
BODIES = {
    name: Scene(name, groupoid, attitude, x0=[0] * (groupoid.dim_x - k * k) + at, v0=[1] * m)
    for name, groupoid, k, at, m in [
        ("skewed-body", action(SKEWED, rows=3), 3, [1, 0, 0, 0, 1, 0, 0, 0, 1], 3),
        ("carried-body", product(pair(1), action(se(2), rows=3)), 3,
         [1, 0, 0, 0, 1, 0, 0, 0, 1], 4),
    ]
}  # fmt: skip


def scheme_of(scene, rule, adjoint):
    found = BODIES.get(scene) or SCENES[scene]
    scheme = Scheme(found, skew if rule == "skew" else rules.get(rule))
    return scheme.adjoint if adjoint else scheme


def slopes_by(letter, column, point):
    """∂(column)/∂letter at a point by differences: 30 of 60 digits are right."""
    aside = Rational(1, 10**15)
    with arithmetic(60).working():
        ahead, back = (
            evaluate_at(column, point | {letter: point[letter] + by}, 60) for by in (aside, -aside)
        )
        return [(a - b) * 10**15 / 2 for a, b in zip(ahead, back, strict=True)]


@pytest.mark.sampled
@pytest.mark.parametrize("adjoint", [False, True])
@pytest.mark.parametrize(("scene", "rule"), [
    ("moving-mass", "trapezoidal"), ("moving-mass", "gauss-2"), ("affine-on-line", "midpoint"),
    ("rigid-body", "lobatto-3"), ("pendulum", "skew"), ("affine-group", "skew"),
    ("framed-plane", "skew"), ("spring-pendulum", "imex"), ("skewed-body", "midpoint"),
    ("carried-body", "midpoint"), ("carried-body", "gauss-2"),
])  # fmt: skip
def test_derivatives_through_terms_are_the_slopes_of_what_is_written_out(scene, rule, adjoint):
    of = scheme_of(scene, rule, adjoint)
    maps, s = of.at_points, of.s
    point = random_point([*s.x, *s.u, *s.stages, *s.q], [*s.u, *s.stages, s.h])
    for column in filter(len, (maps.minus, maps.plus, maps.stage_equations)):
        written = of.written_out(column)
        for variable in filter(len, (s.x, s.u, s.stages)):
            total = maps.total(column, variable)
            found = evaluate_at(total, point, 60, maps.definitions(total))
            for j, letter in enumerate(variable):
                wanted = slopes_by(letter, written, point)
                for a, b in zip(found[j :: len(variable)], wanted, strict=True):
                    assert abs(a - b) < 1e-24 * (1 + abs(b))


# -- an oracle: the rule asked with the groupoid's own maps, differentiated as it stands -----------


class Asked:
    """The groupoid without letters: its maps in expressions, for the oracle."""

    def __init__(self, of):
        self.groupoid, self.constant = of.scene.groupoid, of.s.constant

    def __getattr__(self, name):
        return getattr(self.groupoid, name)


class Lagrangian:
    def __init__(self, of):
        self.parameters, self.value = of.s.parameters, of.s.lagrangian_at

    def __call__(self, x, u):
        return self.value(x, u)


def legendre_by_hand(of, formula):
    """F⁻ and F⁺ as the invariant fields applied to the rule's own value."""
    s, g = of.s, of.scene.groupoid
    value = sympy.Matrix([formula(Lagrangian(of), Asked(of), s.x, s.u, s.h)])
    by_u = value.jacobian(s.u).T
    by_x = value.jacobian(s.x).T if len(s.x) else sympy.zeros(0, 1)
    rho, L, R = g.rho(s.x, s.h), g.L(s.x, s.u, s.h), g.R(s.x, s.u, s.h)
    return R.T * by_u - rho.T * by_x, L.T * by_u


def of_an_end(L, G, x, u, h):
    """A target of a target: from the end half a step back."""
    y = G.target(x, u, h)
    return h * (L(G.target(y, u, -h / 2), u) + L(x, u)) / 2


def weighted_by_x(L, G, x, u, h):
    return h * L(G.target(x, u, h / 2), u) * (1 + h**2 * u[0] ** 2)


def bound(L, G, x, u, h):
    """A letter bound by a Subs: the Lagrangian at another velocity."""
    return h * L(x, u) + h * sympy.Subs(L(x, u), u[0], u[0] + h)


def coefficients(L, G, x, u, h):
    return h * L(x, u) + h**3 * L(x, u).expand().coeff(u[0], 2) * u[0] ** 2


def looked_into(L, G, x, u, h):
    """What sympy reads off an expression's form: an answer has another form than what it is."""
    value = L(x, u)
    terms = sympy.Add.make_args(value)
    return h * value + h**3 * (len(terms) * u[0] ** 2 + value.coeff(u[0], 2) * u[-1] ** 2)


def permuted(L, G, x, u, h):
    """L at a point whose first component is a component of the target, the others moved."""
    z = G.target(x, u, h / 2)
    return h * L(z + h * sympy.Matrix([int(i > 0) for i in range(len(z))]), u)


HANDS = (of_an_end, weighted_by_x, bound, coefficients, looked_into, permuted)


@pytest.mark.sampled
@pytest.mark.parametrize(("scene", "hand"), [
    pytest.param(scene, hand, id=f"{hand.__name__}-{scene}")
    for scene in ("moving-mass", "affine-on-line", "framed-plane", "rigid-body")
    for hand in HANDS
    if hand is not permuted or scene != "rigid-body"  # a group has no point to move
])  # fmt: skip
def test_legendre_maps_of_odd_rules_are_the_fields_of_what_they_compute(scene, hand):
    of = Scheme(SCENES[scene], discretisation(name="hand")(hand))
    for maps, wanted in zip(
        (of.legendre_minus, of.legendre_plus), legendre_by_hand(of, hand), strict=True
    ):
        assert first_violation(maps - wanted.doit(), [*of.u, of.h]) is None


@pytest.mark.parametrize("hand", [bound, coefficients, looked_into], ids=lambda f: f.__name__)
def test_the_adjoint_of_an_odd_rule_reads_what_the_rule_reads(hand):
    """At the end of the step and −ι: there coefficients of u would be other ones."""
    of = Scheme(SCENES["affine-on-line"], discretisation(name="hand")(hand))
    run = of.flow("-1/10", 40).trajectory(1)
    x, mu = of.adjoint.flow("1/10", 40).dual_step(run.x[1], run.mu[1])
    assert max(*abs(x - run.x[0]), *abs(mu - run.mu[0])) < 1e-36


@pytest.mark.parametrize("scene", ["kepler", "rigid-body", "affine-on-line"])
def test_nodes_of_a_curve_share_one_function(scene):
    """A term is derived once: three nodes are three calls."""
    system = Scheme(SCENES[scene], rules.get("gauss-3")).flow("0.01", 30).system
    calls = [d.function for d in system.definitions if d.function is not None]
    assert len(calls) == 3 and len(set(calls)) == 1


def test_an_answer_of_another_length_is_refused():
    @discretisation()
    def longer(L, G, x, u, h):
        return h * L(G.target(x.col_join(u[:1, :]), u[1:, :], h), u)

    with pytest.raises(BadInput, match=r"test_terms.py, line .* entries for x"):
        Scheme(SCENES["moving-mass"], longer)


# -- by hand --------------------------------------------------------------------------------------


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
