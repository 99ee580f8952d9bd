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
from discmech.integrators.numbers.nodes import RESULT
from tests.objects import SCENES, SCHEMES, named, scheme


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


@pytest.mark.dear("carried-body", "skewed-body", "3-", "plane")
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
    maps, s = of.arrows, of.s
    point = random_point([*s.x, *s.u, *s.stages, *s.q], [*s.u, *s.stages, s.h])
    for column in filter(len, (maps.minus, maps.plus, maps.stage_equations)):
        written = of.arrows.written_out(column)
        for variable in filter(len, (s.x, s.u, s.stages)):
            total = of.equations.total(column, variable)
            found = evaluate_at(total, point, 60, maps.of.graph)
            for j, letter in enumerate(variable):
                wanted = slopes_by(letter, written, point)
                for a, b in zip(found[j :: len(variable)], wanted, strict=True):
                    assert abs(a - b) < 1e-24 * (1 + abs(b))


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "rule"), named(SCHEMES))
def test_the_slope_of_every_scheme_is_that_of_its_rows(scene, rule):
    of = scheme(scene, rule)
    maps, s = of.arrows, of.s
    point = random_point([*s.x, *s.u, *s.stages, *s.q], [*s.u, *s.stages, s.h])
    point |= s.constant_values(80) | s.identity_translate  # as `written_out` has it
    written = of.arrows.written_out(maps.system)
    found = evaluate_at(maps.slope, point, 60, maps.of.graph)
    for j, letter in enumerate(of.w):
        wanted = slopes_by(letter, written, point)
        for a, b in zip(found[j :: len(of.w)], wanted, strict=True):
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


def differentiated(L, G, x, u, h):
    """A point reached, by the point it starts from: the chain rule, not 0. The Hessian of L."""
    z = G.target(x, u, h / 2)
    slope = sympy.sin(z[0]).diff(x[0]) if len(z) else 0
    mass = sympy.hessian(L(x, u), list(u))[0, 0]
    return h * L(z, u) + h**3 * slope + h**3 * mass * u[0] ** 2


def rooted(L, G, x, u, h):
    y = [*G.target(x, u, h), u[0]]
    return h * L(x, u) + h**3 * (sympy.sqrt(1 + y[0] ** 2) + sympy.sqrt(y[0] + 9))


def replaced(L, G, x, u, h):
    """Letters replaced in an answer are replaced in what it stands for."""
    return h * (L(x, u) + L(G.target(x, u, h), u).subs(h, 0)) / 2


def multiplied(L, G, x, u, h):
    """No weighted sum of values: derived as it stands."""
    one, other = L(x, u), L(G.target(x, u, h), u)
    return h * (one + other) / 2 + h**3 * one * other


def of_a_polynomial(L, G, x, u, h):
    """A polynomial is made of what an answer stands for."""
    kinetic = sympy.Poly(L(x, u), u[0]).coeff_monomial(u[0] ** 2) * u[0] ** 2
    return h * L(x, u) + h**3 * kinetic


HANDS = (of_an_end, weighted_by_x, bound, coefficients, looked_into, permuted, differentiated,
         rooted, replaced, multiplied, of_a_polynomial)  # fmt: skip


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
    nodes = Scheme(SCENES[scene], rules.get("gauss-3")).flow("0.01", 30).system
    calls = {e.args[0] for e in nodes.graph.order(nodes.rows) if e.kind == RESULT}
    assert len(calls) == 3 and len({call.function for call in calls}) == 1


def test_an_answer_of_another_length_is_refused():
    @discretisation()
    def longer(L, G, x, u, h):
        return h * L(G.target(x.col_join(u[:1, :]), u[1:, :], h), u)

    with pytest.raises(BadInput, match=r"test_terms.py, line .* entries for x"):
        Scheme(SCENES["moving-mass"], longer)


def test_a_point_moved_by_hand_is_another_point():
    """One component as it was reached, the other moved: derivatives by both are right."""

    @discretisation()
    def sideways(L, G, x, u, h):
        return h * L(G.target(x, u, h / 2) + h * sympy.Matrix([0, Rational(1, 10)]), u)

    of = Scheme(scenes.get("kepler"), sideways)
    for variable in (of.x, of.u):
        through = of.arrows.written_out(of.equations.total(of.arrows.minus, variable))
        written = of.legendre_minus.jacobian(variable)
        assert first_violation(through - written, [*of.u, of.h]) is None
