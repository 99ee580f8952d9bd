"""Compositions: adjoints of rules, and what a flow makes of substeps."""

import itertools
from fractions import Fraction
from functools import cache

import mpmath
import numpy as np
import pytest
import sympy

from discmech.integrators import (
    BadInput,
    Scene,
    Scheme,
    StepFailure,
    action,
    compiler,
    midpoint,
    on_group,
    pair,
    rectangle,
    so,
)
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.numbers import exact_rational
from discmech.integrators.rules import Composition, adjoint, compose, get, names, own
from tests.integrators.rules.test_stages import close
from tests.objects import SCENES, scheme

DIGITS = 50
CASES = [
    ("pendulum", "kahan-li-8:trapezoidal"),
    ("kepler", "blanes-moan-6:rectangle"),
    ("rigid-body", "kahan-li-6:midpoint"),
    pytest.param("heavy-top", "triple-jump:midpoint", marks=pytest.mark.slow),
    ("affine-on-line", "suzuki:trapezoidal"),
    ("framed-plane", "blanes-moan-4:midpoint"),
    ("kepler", "triple-jump:gauss-2"),
    ("affine-group", "triple-jump:gauss-1"),
]
cases = pytest.mark.parametrize(("scene", "rule"), CASES)


@cache
def flow_of(scene, rule, sign=1, digits=DIGITS):
    return scheme(scene, rule).flow(sign * SCENES[scene].step, digits)


@pytest.mark.parametrize(("scene", "rule"), [
    ("kepler", "rectangle"), ("rigid-body", "midpoint"), ("heavy-top", "rectangle"),
    ("affine-on-line", "midpoint"),
    *(pytest.param(*pair_, marks=pytest.mark.slow) for pair_ in (
        ("kepler", "midpoint"), ("rigid-body", "rectangle"), ("kepler", "gauss-2"),
        ("rigid-body", "gauss-2"),
        ("heavy-top", "midpoint"), ("heavy-top", "gauss-2"),
        ("affine-on-line", "rectangle"), ("affine-on-line", "gauss-2"))),
])  # fmt: skip
def test_the_adjoint_is_the_inverse_of_the_step_back(scene, rule):
    of = scheme(scene, rule)
    back, forth = of.flow(-SCENES[scene].step, DIGITS), of.adjoint.flow(SCENES[scene].step, DIGITS)
    with mpmath.workdps(60):
        run = back.trajectory(1)
        x, mu = forth.dual_step(run.x[1], run.mu[1])
        assert close([*x, *mu], [*run.x[0], *run.mu[0]])
        assert forth.pullback_defect(run.x[1], forth.inverse_legendre(run.x[1], run.mu[1])) < 1e-45
        there = of.flow(SCENES[scene].step, DIGITS).trajectory(1)
        same = close([*forth.trajectory(1).mu[1]], [*there.mu[1]])
    assert same is of.self_adjoint


def test_the_adjoint_of_the_adjoint_is_the_rule():
    twice = Scheme(SCENES["kepler"], adjoint(adjoint(rectangle)))
    difference = twice.legendre_minus - scheme("kepler", "rectangle").legendre_minus
    assert difference.applyfunc(lambda e: e.simplify()).is_zero_matrix


def in_chart(x, u, h, p):
    return h * (u[0] ** 2 / 2 + sympy.cos(x[0]))


def on_elements(x, g, h, p):
    y = x.T * g
    return -(sympy.diag(3, 2, 1) * g).trace() / h - h * (y[0] + x[1] * y[2])


@pytest.mark.parametrize("scene", [
    Scene("in-chart", pair(1), discrete_lagrangian=in_chart, x0=[1], v0=[0]),
    pytest.param(
        Scene("on-elements", action(so(3)), discrete_lagrangian=on_group(on_elements),
              x0=["3/5", 0, "4/5"], v0=[0, 0, 0]), marks=pytest.mark.slow),
], ids=lambda scene: scene.name)  # fmt: skip
def test_the_adjoint_of_a_discrete_lagrangian_that_a_scene_gives(scene):
    """It is another step, and without it a composition is of the order of the base."""
    of = Scheme(scene, own)
    assert not of.self_adjoint
    mu0 = ["1/3", "1/5", "-1/4"][: len(of.u)]
    run = of.flow("-1/10", DIGITS).trajectory(1, mu0=mu0)
    with mpmath.workdps(60):
        x, mu = of.adjoint.flow("1/10", DIGITS).dual_step(run.x[1], run.mu[1])
        assert close([*x, *mu], [*run.x[0], *run.mu[0]])
    composed = compose(of, "triple-jump")
    ends = [composed.flow(f"1/{n}", 30).trajectory(n, n, mu0=mu0).mu[-1] for n in (10, 20, 40)]
    first, second = (float(max(abs(a - b))) for a, b in itertools.pairwise(ends))
    assert np.log2(first / second) == pytest.approx(4, abs=0.05)


@pytest.mark.dear("on-", "plane")
@cases
def test_a_step_is_its_substeps_one_by_one(scene, rule):
    f = flow_of(scene, rule)
    of, steps = f.scheme, f.scheme.substeps
    assert len(steps) == len(f.parts)
    with mpmath.workdps(60):
        run = f.trajectory(2)
        x, mu = run.x[0], run.mu[0]
        for step in steps:
            size = exact_rational(step.coefficient(80), "coefficient")
            part = of.adjoint if step.adjoint else of.base
            x, mu = part.flow(size * f.step, DIGITS).dual_step(x, mu)
        assert close([*x, *mu], [*run.x[1], *run.mu[1]])


@cases
def test_poisson_and_self_adjoint(scene, rule):
    forth, back = (flow_of(scene, rule, sign) for sign in (1, -1))
    with mpmath.workdps(60):
        run = forth.trajectory(1)
        for row in (0, 1):
            assert forth.poisson_defect(run.x[row], run.mu[row]) < 1e-45
        x, mu = back.dual_step(run.x[1], run.mu[1])
        assert forth.scheme.self_adjoint
        assert close([*x, *mu], [*run.x[0], *run.mu[0]])
    if SCENES[scene].groupoid.kind == "action":
        assert forth.poisson_defect(run.x[0], run.mu[0], bracket_sign=-1) > 1e-25


def test_compositions_of_a_rule_share_their_kernels():
    one, two = (flow_of("pendulum", f"{m}:trapezoidal", 1, 16) for m in ("suzuki", "kahan-li-6"))
    assert one._kernels.layout == two._kernels.layout and one.system.keys == two.system.keys
    assert compiler.kernel_text(one.system) == compiler.kernel_text(two.system)
    sizes = {part.step for part in two.parts}
    assert len({id(part) for part in two.parts}) == len(sizes) == 5


def test_a_failing_substep_is_a_step_failure():
    f = scheme("pendulum", "triple-jump:midpoint").flow("3")
    with pytest.raises(StepFailure, match="pendulum with triple-jump:midpoint") as caught:
        f.trajectory(50)
    run = caught.value.trajectory
    assert len(run.t) == caught.value.step_index
    assert set(caught.value.state) == {"x", "mu", "u"}


@pytest.mark.dear("triple-jump:own")
@pytest.mark.parametrize("rule", ["triple-jump:own", "triple-jump:rectangle"])
def test_a_composition_shrinks_its_steps_at_the_edge_of_a_chart(rule):
    """All substeps are halved: one step is two, or four, of the first part within the reach."""
    name, step, start = {
        "triple-jump:own": ("moser-veselov", Fraction(1, 2), {"mu0": [2, 2, -1]}),
        "triple-jump:rectangle": ("rigid-body", Fraction(40), {}),
    }[rule]
    of = scheme(name, rule)
    for digits in (16, 30):
        run = of.flow(step, digits, on_edge="shrink").trajectory(4, **start)
        assert run.edges > 0 and len(run.t) == 5
        x, mu = run.x[0], run.mu[0]
        for halvings in range(1, 6):
            count, flow = 2**halvings, of.flow(step / 2**halvings, digits)
            try:
                fine = flow.trajectory(count, count, x0=x, mu0=mu)
            except StepFailure:
                continue
            if fine.margin > 8**-0.5:  # `reach` of so(3)
                assert max(abs(run.mu[1] - fine.mu[-1])) < 10.0 ** (4 - digits)
                break
        else:
            pytest.fail("no part of the step can be solved")


def test_a_composition_does_not_bisect():
    flow = scheme("moser-veselov", "triple-jump:own").flow("0.1", on_edge="bisect")
    with pytest.raises(BadInput, match="lie in different translates; take on_edge="):
        flow.trajectory(1)


def test_a_composition_has_no_step_on_arrows():
    f = flow_of("pendulum", "kahan-li-8:trapezoidal")
    for ask in (f.evolve, f.devolve, f.tangent, f.pullback_defect):
        with pytest.raises(CannotMeasure, match="it steps on"):
            ask([1], [1])


def test_the_order_of_a_composition_is_its_own_or_its_base_s():
    """Whichever is higher: a triple jump of a rule of order 6 keeps that."""
    assert flow_of("pendulum", "kahan-li-8:trapezoidal").scheme.order == 8
    assert scheme("kepler", "triple-jump:gauss-3").order == 6


def test_schemes_are_composed_as_rules_are():
    base = scheme("kepler", "midpoint")
    composed = compose(base, "suzuki")
    assert isinstance(composed.rule, Composition) and composed.rule.name == "suzuki:midpoint"
    assert composed.order == 4 and len(composed.substeps) == 5
    assert base.substeps == ()


@pytest.mark.parametrize(("make", "words"), [
    (lambda: compose(midpoint, "kahan-li-7"), "did you mean kahan-li-[68]"),
    (lambda: compose("midpoint", "suzuki"), "'midpoint' is no rule"),
    (lambda: compose(compose(midpoint, "suzuki"), "suzuki"), "is a composition already"),
    (lambda: get("kahan-li-8:mid"), 'no rule "mid"'),
    (lambda: get("suzuki:suzuki:midpoint"), "is a composition already"),
    (lambda: get("kahan-li-8"), "did you mean kahan-li-8:trapezoidal"),
])  # fmt: skip
def test_bad_input_is_one_sentence(make, words):
    with pytest.raises(BadInput, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_names_are_known():
    for name in names():
        rule = get(name)
        assert rule.name == name and rule.source and rule.order
        assert get(name) == rule


def test_the_defects_of_a_composition_are_those_of_all_its_substeps():
    """A step of the base rule alone is Poisson too, so only the residual tells them apart."""
    flow = scheme("pendulum", "triple-jump:midpoint").flow("0.1", 50)
    run = flow.trajectory(1)
    (x, after_x), (mu, after_mu), u = run.x, run.mu, run.u[0]
    assert flow.step_defect(x, mu, after_x, after_mu, u0=u) < 1e-48
    other = scheme("pendulum", "midpoint").flow("0.1", 50).trajectory(1)
    assert flow.step_defect(x, mu, other.x[1], other.mu[1], u0=u) > 1e-8
