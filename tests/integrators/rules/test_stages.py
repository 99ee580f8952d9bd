"""Rules with internal stages: derived from first principles, on every kind of groupoid.

The discrete Lagrangian is evaluated here by the rule's own formula on numbers, with stages that are
shown to be stationary; nothing is shared with the atoms and the chain rule of `integrators`.
"""

from functools import cache

import mpmath
import numpy as np
import pytest
import sympy
from sympy import Float, Matrix, Rational

from discmech.integrators import Scheme, discretisation
from discmech.integrators.rules import gauss, get
from tests.objects import SCENES, scheme_of

#: one rule a scene in the fast suite, each rule on some; all of them in the slow one
FAST = [("pendulum", "lobatto-3"), ("kepler", "gauss-2"), ("moving-mass", "gauss-1"),
        ("rigid-body", "gauss-1"), ("affine-group", "gauss-2"),
        ("affine-on-line", "lobatto-3"), ("framed-plane", "lobatto-2"),
        ("rotor-body", "gauss-1")]  # fmt: skip
RULES = ["gauss-1", "gauss-2", "lobatto-2", "lobatto-3"]
REST = [(s, r) for s in [*dict(FAST), "heavy-top", "wong"] for r in RULES if (s, r) not in FAST]
CASES = [*FAST, *(pytest.param(*pair_, marks=pytest.mark.slow) for pair_ in REST)]
DIGITS = 50


@discretisation(order=4, stages=1)
def simpson(L, G, x, u, h, s):
    """Lobatto with three nodes, its stage the bump of the path in the middle, written by hand."""

    def node(theta):
        w, dw = theta * u + 4 * theta * (1 - theta) * s[0], u + 4 * (1 - 2 * theta) * s[0]
        return L(G.target(x, w, h), G.velocity(x, w, dw, h))

    return h * (node(Rational(0)) + 4 * node(Rational(1, 2)) + node(Rational(1))) / 6


def rule_of(name):
    return simpson if name == "simpson" else get(name)


@cache
def flow_of(scene, rule, step=None, digits=DIGITS):
    of = scheme_of(SCENES[scene], rule_of(rule))
    return of.flow(step or SCENES[scene].step, digits)


def start_of(f):
    scene = f.scheme.scene
    v0 = scene.v0 if any(scene.v0) else [Rational(1, 3 + i) for i in range(len(scene.v0))]
    return f.context.vectors(scene.x0, v0)


def close(a, b, limit=1e-44):
    gap = max((abs(p - q) for p, q in zip(a, b, strict=True)), default=0)
    return gap <= limit * (1 + max(map(abs, b), default=0))


class Numbers:
    """L_d of a scheme as a function of numbers, by the rule's formula and the groupoid's maps."""

    def __init__(self, f):
        of = f.scheme
        self.g, self.formula, self.stages = of.scene.groupoid, of.rule.formula, of.rule.stages
        self.h = Rational(f.step.numerator, f.step.denominator)
        values = zip(of.s.parameter_list, of.scene.parameter_values, strict=True)
        given = {p: Rational(v.numerator, v.denominator) for p, v in values}

        class Lagrangian:
            parameters = of.s.parameters

            def __call__(self, x, u):
                return of.scene.lagrangian(x, u, self.parameters)

        class Groupoid:
            target = self.g.target

            @staticmethod
            def velocity(x, w, dw, h):
                return self.g.inverse_left(x, w, h) * dw

            @staticmethod
            def constant(value):
                return Float(value(100), 100)

        self.lagrangian, self.groupoid, self.given = Lagrangian(), Groupoid(), given

    def __call__(self, x, u, s):
        m = len(u)
        columns = [Matrix(s[i : i + m]) for i in range(0, len(s), m)]
        more = [columns] if self.stages else []
        value = self.formula(self.lagrangian, self.groupoid, x, u, self.h, *more)
        value = value[0] if hasattr(value, "shape") else value
        return value.xreplace(self.given).evalf(90)

    def slope(self, curve):
        e = Rational(1, 10**25)
        ahead, back, far, far_back = (self(*curve(k * e)) for k in (1, -1, 2, -2))
        return (8 * (ahead - back) - (far - far_back)) / (12 * e)


def column(values):
    return Matrix(len(values), 1, [Float(mpmath.nstr(v, 80), 80) for v in values])


every_case = pytest.mark.parametrize(("scene", "rule"), [*CASES, ("kepler", "simpson")])


@cache
def arrow_of(scene, rule):
    """(L_d on numbers; x, u and the stages there; F⁺ and F⁻), to 50 digits."""
    f = flow_of(scene, rule)
    with f.numbers.working():
        x, u = start_of(f)
        maps, s = f.geometry.at(x, u), f.geometry.stages(x, u)
        public = [f.numbers.public(v) for v in (x, u, s, maps["plus"], maps["minus"])]
    with mpmath.workdps(90):
        return Numbers(f), *map(column, public)


def units(count):
    return [sympy.eye(count)[:, i] for i in range(count)]


@every_case
def test_stages_are_stationary(scene, rule):
    L_d, x, u, s, *_ = arrow_of(scene, rule)
    with mpmath.workdps(90):
        for one in units(len(s)):
            assert abs(L_d.slope(lambda e, one=one: (x, u, s + e * one))) < 1e-40


@pytest.mark.dear("body", "on-")
@every_case
def test_legendre_maps_are_derivatives_along_arrows(scene, rule):
    """By the envelope theorem the stages may stay where they are."""
    L_d, x, u, s, plus, minus = arrow_of(scene, rule)
    g, h = L_d.g, L_d.h

    def after(e):
        return x, g.product(x, u, e, h), s

    def before(e):
        start = g.target(x, e, h)
        return start, g.product(start, g.inversion(x, e, h), u, h), s

    with mpmath.workdps(90):
        for a, one in enumerate(units(len(u))):
            for found, sign, curve in ((plus[a], 1, after), (minus[a], -1, before)):
                wanted = sign * L_d.slope(lambda e, one=one, curve=curve: curve(e * one))
                assert abs(found - wanted) < 1e-36 * (1 + abs(wanted)), a


def test_a_rule_by_hand_is_the_family_s():
    """The same polynomials in another basis: the same map, from other stages."""
    for scene in ("kepler", "affine-on-line"):
        one, two = (flow_of(scene, r).trajectory(3) for r in ("simpson", "lobatto-3"))
        with mpmath.workdps(60):
            assert close(one.mu.ravel(), two.mu.ravel())
            assert close(one.x.ravel(), two.x.ravel())


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["pendulum", "rigid-body", "heavy-top"])
def test_a_stale_stage_is_caught(scene):
    """Stages off by one part in 10²⁰ are no step of the equations.

    The forms are kept all the same: Ω and TΨ are made of second derivatives, which are symmetric
    wherever the stages are.
    """
    f = flow_of(scene, "gauss-2").scheme.flow(SCENES[scene].step, DIGITS)
    run = f.trajectory(1)
    step = run.x[0], run.mu[0], run.x[1], run.mu[1]
    assert f.step_defect(*step, u0=run.u[0]) < 1e-60
    other = f.scheme.flow(SCENES[scene].step, DIGITS)  # maps of the last points are kept
    geometry = other.context.exactly.geometry
    right, m = geometry.unknowns, len(run.u[0])

    def stale(*state):
        u, stages = np.split(right(*state), [m])
        return np.concatenate([u, stages * (1 + f.numbers.number("1e-20"))])

    geometry.unknowns = stale
    assert other.step_defect(*step, u0=run.u[0]) > 1e-35


def test_derivatives_are_schur_complements():
    """FL of the symbols is the Schur complement, and F⁻ along ∂L_d/∂s = 0 has that slope."""
    f = flow_of("kepler", "gauss-2")
    of = f.scheme
    with f.numbers.working(), mpmath.workdps(60):
        x, u = start_of(f)
        here, s = f.geometry.at(x, u), f.geometry.stages(x, u)
        values = f.numbers.public([*x, *u, *s, *f.context.q])
        wanted = -f.numbers.public(here["minus_u"]).T
    letters = [*of.x, *of.u, *of.s.stages, *of.s.q]
    pairs = zip(letters, values, strict=True)
    point = {letter: Float(mpmath.nstr(v, 60), 60) for letter, v in pairs}
    found = of.FL.xreplace(point).evalf(60)
    with mpmath.workdps(60):
        assert close(map(mpmath.mpf, map(str, found)), wanted.ravel(), 1e-40)
    assert all(
        abs(e.xreplace(point).evalf(60)) < 1e-45
        for e in of.discrete.written_out(of.discrete.stage_equations)
    )


def test_one_node_and_two_are_midpoint_and_trapezoidal_on_pairs():
    for ours, theirs in (("gauss-1", "midpoint"), ("lobatto-2", "trapezoidal")):
        one, two = (flow_of("kepler", r).trajectory(5) for r in (ours, theirs))
        with mpmath.workdps(60):
            assert close(one.mu.ravel(), two.mu.ravel(), 1e-47)


@pytest.mark.parametrize(("scene", "rule", "wanted"), [
    ("pendulum", "gauss-3", True), ("kepler", "gauss-2", True), ("moving-mass", "gauss-1", True),
    # the reversed curve is no polynomial in the chart of the inverse
    ("rigid-body", "lobatto-3", False),
    pytest.param("heavy-top", "gauss-2", False, marks=pytest.mark.slow),
    # but here translations by the inverse are affine in the chart
    ("affine-group", "gauss-2", True),
])  # fmt: skip
def test_self_adjointness_is_derived(scene, rule, wanted):
    of = flow_of(scene, rule).scheme
    assert of.self_adjoint is wanted
    forth, back = (of.flow(sign * SCENES[scene].step, DIGITS) for sign in (1, -1))
    with mpmath.workdps(60):
        run = forth.trajectory(1)
        x, mu = back.dual_step(run.x[1], run.mu[1])
        assert close([*x, *mu], [*run.x[0], *run.mu[0]]) is wanted


@pytest.mark.slow
def test_velocities_of_curves_have_their_order_in_every_chart():
    """Where u alone is a velocity to first order only, gauss-1 is of order 2 all the same."""
    for scene in ("affine-group", "affine-on-line", "framed-plane"):
        of = Scheme(SCENES[scene], gauss(2))
        assert of.order == 4
        assert Scheme(SCENES[scene], get("midpoint")).order == 1
        ends = []
        for steps in (16, 32, 256):
            run = of.flow(f"1/{2 * steps}", 30).trajectory(steps, steps)
            ends.append(np.concatenate([run.x[-1], run.mu[-1]]))
        errors = [float(max(abs(end - ends[-1]))) for end in ends[:2]]
        assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.05)


def test_an_affine_system_takes_one_correction():
    run = flow_of("harmonic", "gauss-3", digits=16).trajectory(100)
    assert (run.newton_mean, run.newton_max) == (1, 1)


def test_any_number_of_digits():
    """Nodes and weights are computed to the digits of the run: energy's order needs them all."""
    of = Scheme(SCENES["harmonic"], gauss(3))
    runs = [of.flow("1/8", digits).trajectory(3) for digits in (40, 120)]
    with mpmath.workdps(120):
        gap = max(abs(a - b) for a, b in zip(runs[0].mu.ravel(), runs[1].mu.ravel(), strict=True))
        assert 0 < gap < mpmath.mpf(10) ** -40
