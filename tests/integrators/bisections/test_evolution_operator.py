"""The general evolution operator between any two arrows, through chosen or given bisections."""

from functools import cache

import mpmath
import numpy as np
import pytest
import sympy
from sympy import Rational

from discmech.integrators import (
    BadInput,
    Bisection,
    EvolutionOperator,
    Scene,
    Scheme,
    StepFailure,
    lie_group,
    pair,
    rectangle,
    se,
    trapezoidal,
)
from discmech.integrators import rules as discretisations
from tests.objects import SCENES, affine_action


@pytest.mark.slow
def test_bisections_of_another_step_or_groupoid_are_told():
    of_body = scheme("rigid-body")
    group = of_body.scene.groupoid
    fit = Bisection(group, [], [0, 0, 0], 1)
    for other in (Bisection(group, [], [0, 0, 0], 2), Bisection(pair(1), [0], [0], 1)):
        with pytest.raises(BadInput, match="another groupoid, step"):
            EvolutionOperator(of_body.flow(1).context, fit, other)


IN_PLANE = Scene(
    "body-in-space",
    lie_group(se(2)),
    lambda x, v, p: v[0] ** 2 / 2 + v[1] ** 2 + Rational(3, 4) * v[2] ** 2 + v[0] * v[1] / 3,
    v0=["0.5", "0.3", "-0.4"],
)


IN_SPACE = Scene(
    "body-in-space",
    lie_group(se(3)),
    lambda x, v, p: (
        v[:3, :].dot(v[:3, :]) / 2 + v[0] ** 2 + v[3:, :].dot(v[3:, :]) + v[0] * v[4] / 3
    ),
    v0=["0.5", "0.3", "-0.4", "0.2", "0.1", "-0.3"],
)


CASES = {
    "rigid-body": (SCENES["rigid-body"], rectangle),
    "body-in-plane": (IN_PLANE, rectangle),
    "heavy-top": (SCENES["heavy-top"], trapezoidal),
    "framed-plane": (SCENES["framed-plane"], trapezoidal),
}


SLOW = {"body-in-space": (IN_SPACE, rectangle)}


@cache
def scheme(name):
    return Scheme(*{**CASES, **SLOW}[name])


def operators(name, x, u, step):
    """Operators with three different choices of bisections around the arrow (x, u)."""
    g = scheme(name).scene.groupoid
    context = scheme(name).flow(step).context
    y = np.array(context.geometry.at(x, u)["target"])
    generator = np.random.default_rng(11)
    for size in (0, 0.05, 0.3):
        arrows = [u * (size > 0) + size * generator.uniform(-1, 1, len(u)) for _ in range(2)]
        slopes = [size * generator.uniform(-1, 1, (len(u), len(x))) for _ in range(2)]
        # x0 such that β(x0, σ) is near x: the bisection's arrows end where g's source is
        sigma = Bisection(g, x, arrows[0], step, slope=slopes[0])
        yield EvolutionOperator(context, sigma, Bisection(g, y, arrows[1], step, slope=slopes[1]))


@pytest.mark.dear(but=("body",))
@pytest.mark.parametrize("name", [
    pytest.param(n, marks=pytest.mark.slow if n in ("heavy-top", "body-in-plane") else ())
    for n in CASES
])  # fmt: skip
def test_the_step_is_the_same_whichever_bisections_are_chosen(name):
    step = CASES[name][0].step
    flow = scheme(name).flow(step)
    x, u = (
        np.array([float(e) for e in values]) for values in (CASES[name][0].x0, CASES[name][0].v0)
    )
    wanted = flow.evolve(x, u)
    for operator in operators(name, x, u, step):
        found = operator.evolve(x, u)
        for a, b in zip(found, wanted, strict=True):
            assert np.allclose(a, b, rtol=0, atol=1e-12)
        back = operator.devolve(*found)
        for a, b in zip(back, (x, u), strict=True):
            assert np.allclose(a, b, rtol=0, atol=1e-11)
        y, v = operator.upsilon.without_right(*found)
        bar = np.linalg.cond(operator.FL(y, v)), np.linalg.cond(operator.barred_FL(y, 0 * v))
        assert max(bar) < 100
        near = operator.sigma.without_left(x, u)
        assert np.max(abs(operator.residual(*near, v))) < 1e-13


def test_the_identity_bisections_give_the_local_operator():
    flow = scheme("rigid-body").flow("0.1")
    operator = EvolutionOperator(flow.context)
    x, u = [], [0.3, -0.4, 0.5]
    for found, wanted in ((operator.evolve(x, u), flow.evolve(x, u)),
                          (operator.devolve(x, u), flow.devolve(x, u)),
                          ((operator.tangent(x, u),), (flow.tangent(x, u),))):  # fmt: skip
        for a, b in zip(found, wanted, strict=True):
            assert np.allclose(a, b, rtol=0, atol=1e-14)
    assert operator.pullback_defect(x, u) < 1e-15
    assert np.max(abs(operator.residual(np.array([]), u, operator.evolve(x, u)[1]))) < 1e-14


def test_a_trajectory_through_bisections_that_are_chosen_or_given():
    """Also the defects: TΨ is composed of T L_Σ, T R_Υ and the step between g_W and h_W."""
    flow = scheme("framed-plane").flow(SCENES["framed-plane"].step)
    run = flow.trajectory(5)
    operator = EvolutionOperator(flow.context)
    x, u = run.x[0], run.u[0]
    chosen = operator.trajectory(5, x, u)
    sigma, upsilon = operator.bisections_at(x, u)
    own = EvolutionOperator(flow.context, sigma, upsilon)
    for xs, us in (chosen, own.trajectory(5, x, u),
                   operator.trajectory(5, x, u, lambda *_: (sigma, upsilon))):  # fmt: skip
        assert xs.shape == run.x.shape and us.shape == run.u.shape
        assert max(np.max(abs(xs - run.x)), np.max(abs(us - run.u))) < 1e-12
    assert np.allclose(own.tangent(x, u), flow.tangent(x, u), rtol=0, atol=1e-12)
    assert own.pullback_defect(x, u) < 1e-15
    damped = flow.context.geometry.at
    flow.context.geometry.at = lambda x, u: {
        k: v * (1 - 1e-6) if k.endswith("plus") else v for k, v in damped(x, u).items()
    }
    assert own.pullback_defect(x, u) > 1e-9  # a control: F⁺ is a little too small


def test_galerkin_rules_have_the_general_operator_too():
    scene = SCENES["pendulum"]
    flow = Scheme(scene, discretisations.get("gauss-2")).flow("0.1", 30)
    x, u = ["1/2"], ["1/3"]
    sigma, upsilon = (Bisection(scene.groupoid, x, [w], "0.1", 30) for w in ("0.4", "0.2"))
    found = EvolutionOperator(flow.context, sigma, upsilon).evolve(x, u)
    for a, b in zip(found, flow.evolve(x, u), strict=True):
        assert np.max(abs(a - b)) < 1e-28


def test_translations_and_the_operators_maps_have_all_digits():
    """Whoever calls them: nothing is computed in another precision that happens to be at work."""
    x, u = [], ["0.5", "0.25", Rational(1, 3)]
    body = SCENES["rigid-body"]
    short, long = (
        Bisection(body.groupoid, x, ["0.1", "0.2", "0.3"], "0.1", digits) for digits in (50, 70)
    )
    for name in ("left", "right", "without_left", "without_right"):
        assert np.max(abs(getattr(short, name)(x, u)[1] - getattr(long, name)(x, u)[1])) < 1e-50
    operators = [
        EvolutionOperator(Scheme(body, rectangle).flow("0.1", sigma.numbers.digits).context, sigma)
        for sigma in (short, long)
    ]
    for name, arrow in (("residual", (x, u, u)), ("FL", (x, u)), ("barred_FL", (x, u))):
        first, second = (getattr(operator, name)(*arrow) for operator in operators)
        assert isinstance(first.flat[0], mpmath.mpf)
        with mpmath.workdps(80):
            assert np.max(abs(first - second)) < 1e-50


def test_what_is_no_arrow_context_or_bisection_is_refused():
    with pytest.raises(BadInput, match=r"β is no diffeomorphism .* or take another arrow"):
        Bisection(affine_action(), [0], [-10, 0], "0.1")  # 1 + hu₀ = 0: b has no value there
    flow = scheme("rigid-body").flow("0.1")
    with pytest.raises(BadInput, match=r"is <.*Flow.*>: give flow\.context"):
        EvolutionOperator(flow)
    with pytest.raises(BadInput, match=r"rigid-body: 'e' is no bisection: give Bisection\("):
        EvolutionOperator(flow.context, "e")
    operator = EvolutionOperator(flow.context)
    for steps in (-1, "3", 1.0, True):
        with pytest.raises(BadInput, match=r"steps is .*: give a whole number from 0"):
            operator.trajectory(steps, [], [1, 2, 3])
    for method in (operator.evolve, operator.FL, Bisection(flow.scheme.scene.groupoid, [],
                                                           [1, 2, 3], 1).left):  # fmt: skip
        with pytest.raises(BadInput, match="a vector has 2 entries, but 3 are needed"):
            method([], [1, 2])


def test_an_arrow_where_the_lagrangian_has_no_value_is_a_failed_step():
    scene = Scene(
        "arc", pair(1), lambda x, v, p: v[0] ** 2 / 2 + sympy.asin(x[0]), x0=["0.1"], v0=["0.1"]
    )
    operator = EvolutionOperator(Scheme(scene, trapezoidal).flow("0.1").context)
    for method in (operator.evolve, operator.devolve, operator.FL, operator.pullback_defect):
        with pytest.raises(StepFailure, match=r"arc .* L_d or a derivative of it is no number"):
            method([2], [0])


def test_a_composition_has_no_operator_on_arrows():
    flow = Scheme(SCENES["pendulum"], discretisations.get("triple-jump:midpoint")).flow("0.1")
    with pytest.raises(BadInput, match="it steps on"):
        EvolutionOperator(flow.context)
