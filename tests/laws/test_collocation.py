"""Rules with stages on Gauss or Lobatto nodes: the fixed point of collocation is Newton's step."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import sympy

from discmech.integrators import Scene, Scheme, cayley, exponential, pair, rules
from discmech.integrators.compiler.kernels import names_of
from discmech.integrators.compiler.lanes import lane_namespace, tables
from discmech.integrators.compiler.stage_text import text_of_stages
from discmech.integrators.equations import stage_source
from tests.objects import SCENES

#: one scene on each kind of groupoid, and what stays with Newton
ON_EACH = (
    "pendulum", "kepler", "double-pendulum", "rigid-body", "kirchhoff", "sl2",
    "heavy-top", "spherical-pendulum", "wong", "rotor-body", "reduced-kepler", "moving-mass",
    "rigid-body-by-hand", "heavy-top-by-hand", "affine-group", "affine-on-line", "framed-plane",
    "moebius", "stereographic", "carried-along",
)  # fmt: skip
#: derived and compiled in a second or two
SHORT = ("pendulum", "kepler", "rigid-body", "affine-on-line")
STEPS = 12
LOBATTO = "on Lobatto nodes it is collocation where μ is a constant matrix times ẋ alone"


def both(scene, rule, step, digits=16):
    """The flow of a rule, and one whose steps are Newton's alone."""
    scheme = Scheme(scene, rules.get(rule))
    fixed, newton = (scheme.flow(step, digits) for _ in range(2))
    newton.stages = None
    return fixed, newton


def distance(one, other):
    """The largest difference of two runs, by the size of the quantity."""
    pairs = [(getattr(one, name), getattr(other, name)) for name in ("x", "mu", "u")]
    return max(float(abs(a - b).max() / (1 + abs(b).max())) for a, b in pairs if b.size)


@pytest.mark.dear("rigid-body")
@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=() if n in SHORT else pytest.mark.slow) for n in ON_EACH]
)
def test_it_is_newtons_step(name):
    scene = SCENES[name]
    fixed, newton = both(scene, "gauss-3", 2 * scene.step)
    run, wanted = fixed.trajectory(STEPS), newton.trajectory(STEPS)
    assert run.solver == "fixed point" and wanted.solver == "Newton"
    assert 0 <= run.contraction < 1
    assert distance(run, wanted) < 64 * STEPS * 2.0**-53


@pytest.mark.sampled
@pytest.mark.parametrize("name", ["pendulum", "henon-heiles", "damped-pendulum"])
@pytest.mark.parametrize("rule", ["lobatto-4", "lobatto-5"])
def test_on_lobatto_nodes_too(name, rule):
    """With forces as well: IIIA for x and IIIB for μ; μ_ij + μ̂_ji = 1 to the last bit."""
    scene = SCENES[name]
    fixed, newton = both(scene, rule, 2 * scene.step)
    run, wanted = fixed.trajectory(STEPS), newton.trajectory(STEPS)
    assert run.solver == "fixed point" and wanted.solver == "Newton"
    assert distance(run, wanted) < 64 * STEPS * 2.0**-53
    nodes = fixed.scheme.rule.nodes
    found = tables(nodes, nodes.count, nodes.count, fixed.numbers)
    mu, dual = (np.array(found[name][0]).T for name in ("MU", "MU_OF_MOMENTUM"))
    assert (mu + dual.T == 1).all() and not np.array_equal(mu, dual)


@pytest.mark.parametrize(("name", "rule"), [
    ("pendulum", "lobatto-3"), ("pendulum", "gauss-2"), ("heavy-top", "gauss-2"),
])  # fmt: skip
def test_fifty_digits_need_no_elimination(name, rule):
    fixed, newton = both(SCENES[name], rule, SCENES[name].step, digits=50)
    run = fixed.trajectory(2)
    assert run.solver == "fixed point" and distance(run, newton.trajectory(2)) < 1e-50


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "retraction"),
    [("rigid-body", cayley),
     pytest.param("rigid-body", exponential, marks=pytest.mark.slow),
     pytest.param("heavy-top", cayley, marks=pytest.mark.slow),
     pytest.param("heavy-top", exponential, marks=pytest.mark.slow)],
)  # fmt: skip
def test_in_both_charts_with_coarse_steps(name, retraction):
    """With long steps π₀ differs from μ by 10⁻⁷ and more."""
    fixed, newton = both(SCENES[name].with_retraction(retraction), "gauss-3", "0.25")
    run = fixed.trajectory(STEPS)
    assert run.solver == "fixed point"
    assert distance(run, newton.trajectory(STEPS)) < 1e-13


@pytest.mark.dear("rigid-body-lobatto", "4-", "triple")
@pytest.mark.parametrize(("name", "rule", "why"), [
    ("harmonic", "gauss-2", "the equations are linear, and one correction solves them"),
    ("kepler", "lobatto-3", "a step of so few stages takes Newton's method no longer"),
    ("double-pendulum", "lobatto-4", LOBATTO),
    ("rigid-body", "lobatto-4", LOBATTO),
    ("kepler", "gauss-2", "a step of so few stages takes Newton's method no longer"),
    ("kepler", "midpoint", "the rule has no stages on Gauss or Lobatto nodes"),
    ("kepler", "triple-jump:gauss-2", "a composition has steps of several sizes"),
])  # fmt: skip
def test_where_newton_does_all_it_says_why(name, rule, why):
    fixed, _ = both(SCENES[name], rule, "0.1")
    assert fixed.stages is None and fixed.by_newton == why
    assert fixed.trajectory(1).solver == "Newton"


def test_stiff_scenes_go_on_by_newton():
    """With a step of several periods of the stiff spring nothing contracts."""
    scene = SCENES["spring-pendulum"]
    fixed, newton = both(scene, "gauss-3", "1")
    run, wanted = fixed.trajectory(40), newton.trajectory(40)
    assert run.solver == "fixed point, Newton in 40 of 40 steps"
    assert np.array_equal(run.mu, wanted.mu)


@pytest.mark.slow
@pytest.mark.parametrize("digits", [16, 20])
def test_halved_steps_are_counted_as_newtons(digits):
    """At the edge of a chart, which no whole step of this size stays away from."""
    scheme = Scheme(SCENES["rigid-body"], rules.get("gauss-3"))
    run = scheme.flow("20", digits, on_edge="shrink").trajectory(3)
    assert run.edges == 4 and run.solver == "fixed point, Newton in 3 of 3 steps"


def test_a_negative_step_goes_back():
    """On pairs a Gauss rule is its own adjoint."""
    fixed, _ = both(SCENES["kepler"], "gauss-3", "0.1")
    back, _ = both(SCENES["kepler"], "gauss-3", "-0.1")
    run = fixed.trajectory(20)
    again = back.trajectory(20, x0=run.x[-1], mu0=run.mu[-1])
    assert abs(again.mu[-1] - run.mu[0]).max() < 1e-13
    assert abs(again.x[-1] - run.x[0]).max() < 1e-13


def test_a_function_of_ones_own_is_known_by_its_derivatives():
    """Its kernels are those of today's derivative, whatever the cache holds of its name."""

    def pull(slope):
        class Well(sympy.Function):
            def fdiff(self, argindex=1):
                return slope(self.args[0])

        def lagrangian(x, v, p):
            return v[0] ** 2 / 2 - Well(x[0])

        scene = Scene("well", pair(1), lagrangian, x0=["1/2"], v0=[0])
        return Scheme(scene, rules.get("gauss-3")).flow("0.1").trajectory(1).mu[-1, 0]

    assert pull(sympy.sin) != pull(sympy.sinh) == pull(sympy.sinh)


def area(scene, rule, step, sweeps):
    """|det − 1| of the derivative of one step on one degree of freedom, stopped after `sweeps`.

    By differences at 60 digits; a step begun anew, whose iteration begins with a straight line.
    """
    flow = Scheme(scene, rules.get(rule)).flow(step, digits=60)
    nodes = flow.scheme.rule.nodes
    text = text_of_stages(stage_source(flow.scheme.equations.s, nodes).derived())
    given = lane_namespace(nodes.count, flow.numbers, 1)
    given |= tables(nodes, nodes.count, nodes.count, flow.numbers)
    if sweeps:
        text = text.replace("settled = stale > 2 and", "settled = True or")
        given["MOST_SWEEPS"] = sweeps
    stages = flow.stages
    stages.kernels = replace(
        stages.kernels, advance=names_of(text, flow.numbers, **given)["advance"]
    )
    with flow.numbers.working():
        start, small = flow.starting.own, flow.numbers.number(Fraction(1, 10**20))

        def end(dx, dmu):
            point = stages.start_at(
                start.x + dx * small, start.mu + dmu * small, stages.c, start.guess
            )
            run = stages.buffers(point, 1, 1)
            assert stages.advance(run, 1) == 0
            return np.concatenate([run.xs[1], run.mus[1]])

        slopes = [(end(*d) - end(*[-e for e in d])) / (2 * small) for d in ((1, 0), (0, 1))]
        return abs(float(slopes[0][0] * slopes[1][1] - slopes[0][1] * slopes[1][0] - 1))


@pytest.mark.parametrize("sweeps", [1, 2, 3])
def test_an_iteration_stopped_early_is_caught(sweeps):
    """Its area is off by h^2M after M sweeps, π before w; that of a solved one by nothing."""
    scene = SCENES["pendulum"]
    assert area(scene, "gauss-3", "0.1", 0) < 1e-38
    coarse, fine = (area(scene, "gauss-3", step, sweeps) for step in ("0.1", "0.05"))
    assert fine > 1e-30
    assert abs(np.log2(coarse / fine) - 2 * sweeps) < 0.05
