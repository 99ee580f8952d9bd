"""Orders that are not those expected: one constructed case for each cause, and its name."""

from dataclasses import replace
from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy

import discmech.reference as reference
from discmech.integrators import (
    Scene,
    Scheme,
    black_box,
    discretisation,
    exponential,
    lie_group,
    pair,
    scenes,
    so,
)
from discmech.integrators import one_step as one_step_map
from discmech.integrators import rules as discretisations
from discmech.integrators.rules import midpoint, trapezoidal
from discmech.studies import get
from discmech.studies.causes import diagnosis, first_terms
from discmech.studies.causes.diagnosis import _start_gap as start_gap
from discmech.studies.causes.exact_path import slope, truncation
from discmech.studies.causes.first_terms import Beginning
from discmech.studies.causes.points import mean_of_points
from discmech.studies.causes.round_off import residuals
from discmech.studies.causes.turns import across, wrapped
from discmech.studies.core.case import Case, Measurement
from discmech.studies.evidence import evidence_of
from discmech.studies.order.judging import diagnose
from tests.studies.as_json import run_case
from tests.studies.causes.faults import Broken, cause, loose, wrong_start


@discretisation(order=2)
def spoiled(L, G, x, u, h):
    """Midpoint with a kinetic energy that is a little too large."""
    return h * L(G.target(x, u, h / 2), u) + h**2 * u.dot(u) / 7


@discretisation(order=2)
def start_only(L, G, x, u, h):
    """The rectangle rule, which claims what only its points have."""
    return h * L(x, u)


@discretisation(order=4)
def constant(L, G, x, u, h):
    """Exact where u is the velocity of the whole step."""
    return h * L(x, u)


def spherical(retraction=None):
    """A free body with three equal moments of inertia, with its attitude: about an axis."""
    groupoid = lie_group(so(3), retraction) if retraction else lie_group(so(3))
    scene = Scene(
        name="spherical-body", groupoid=groupoid, v0=["1", "1/2", "-1/3"], duration=10,
        lagrangian=lambda x, v, p: v.dot(v) / 2, step="1/10",
    )  # fmt: skip
    return scene.with_attitude()


def order(scene, rule, digits=30, fault=None, steps=None):
    made = Case(
        "order", scenes.get(scene) if isinstance(scene, str) else scene, rule, digits, steps
    )
    return made if fault is None else Broken(**vars(made), fault=fault)


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["kepler", "heavy-top"])
def test_a_wrong_discrete_lagrangian_is_told_with_its_own_order(scene):
    found = cause(order(scene, spoiled))
    assert found["cause"] == "discrete Lagrangian"
    assert found["evidence"]["order_of_legendre"] == pytest.approx(1, abs=0.05)
    assert found["evidence"]["order_of_points"] == pytest.approx(1, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["kepler", "heavy-top"])
def test_a_gauge_term_moves_the_momenta_alone(scene):
    found = cause(order(scene, start_only))
    assert found["cause"] == "gauge"
    assert found["evidence"]["order_of_legendre"] == pytest.approx(1, abs=0.05)
    assert found["evidence"]["order_of_points"] == pytest.approx(2, abs=0.1)


@pytest.mark.parametrize(("formula", "mean"), [
    (lambda L, G, x, u, h: h * L(G.target(x, u, h / 3), u), "1/3"),
    (lambda L, G, x, u, h: h * (L(x, u) + 2 * L(x + h * u, u)) / 3, "2/3"),
    (lambda L, G, x, u, h: h * L(G.target(x, u, 0.4 * h), u), "2/5"),
    (lambda L, G, x, u, h: h * L(G.target(x, u, h / sympy.sqrt(3)), u), "0.5774"),
    (lambda L, G, x, u, h: 0.3 * h * L(x, u) + 0.7 * h * L(G.target(x, u, h), u), "7/10"),
    (midpoint.formula, "1/2"),
    (lambda L, G, x, u, h: h * L(G.target(x, u, h / 3), u) / 2, ""),
    (lambda L, G, x, u, h: h * L(G.target(x, u, h / 3), 2 * u), ""),
    (spoiled.formula, ""),
])  # fmt: skip
def test_the_mean_of_the_points_is_told_of_weighted_sums_on_the_straight_step(formula, mean):
    assert mean_of_points(Scheme(scenes.get("kepler"), discretisation(name="r")(formula))) == mean


@pytest.mark.dear("double-pendulum", "duffing")
@pytest.mark.parametrize(
    ("scene", "named"),
    [("kepler", "gauge"), ("double-pendulum", "discrete Lagrangian"), ("duffing", "discrete Lag")],
)
def test_points_off_the_middle_are_told_with_where_they_lie(scene, named):
    @discretisation(order=2)
    def third(L, G, x, u, h):
        return h * L(G.target(x, u, h / 3), u)

    found = cause(order(scene, third))
    assert found["cause"].startswith(named)
    assert "lies at 1/3 of the step, which makes order 1" in found["sentence"]
    assert found["evidence"]["order_of_midpoint"] == pytest.approx(2, abs=0.05)


@pytest.mark.slow
def test_errors_on_no_straight_line_have_a_cause_too():
    """Local orders of 0.94, 0.97, 0.99 are no asymptotic window, and not those of order 2."""

    @discretisation(order=2)
    def slip(L, G, x, u, h):
        return h * (L(x, u) / 4 + L(G.target(x, u, h / 2), u) / 4 + L(G.target(x, u, h), u) / 2)

    found = run_case(get("order"), order("heavy-top", slip, digits=16))
    assert found["verdict"] == "fail" and found["measured"]["order"] is None
    assert found["diagnosis"]["cause"] == "gauge"


@pytest.mark.parametrize("digits", [30, 50])
def test_a_sound_start_is_none_however_many_digits_it_is_held_against(digits):
    """The top's start is no finite decimal: it is compared to the digits of the run."""
    case = order("heavy-top", midpoint, digits)
    assert start_gap(case, case.scheme.flow("0.01", digits)) < 10.0 ** (1 - digits)


@pytest.mark.slow
def test_a_chart_in_which_the_rule_loses_its_order_is_told_beside_the_other():
    found = cause(order(spherical(), constant))
    assert found["cause"] == "retraction" and "--retraction exponential" in found["sentence"]
    assert found["evidence"]["order_of_legendre"] == pytest.approx(2, abs=0.05)
    assert truncation(Scheme(spherical(exponential), constant)).legendre[-1] < 1e-45


@pytest.mark.slow
def test_no_chart_is_blamed_that_mends_one_turn_about_an_axis_and_no_motion_beside_it():
    turn = Scene(
        name="turn", groupoid=lie_group(so(3)), v0=[1, 0, 0], duration=10, step="1/10",
        lagrangian=lambda x, v, p: (v[0] ** 2 + 2 * v[1] ** 2 + 3 * v[2] ** 2) / 2,
    )  # fmt: skip
    assert cause(order(turn.with_attitude(), constant))["cause"] == "discrete Lagrangian"
    other = truncation(Scheme(replace(turn, groupoid=lie_group(so(3), exponential)), constant))
    assert other.order == np.inf


def test_a_wrong_start_is_told_by_its_momentum():
    found = cause(order("kepler", trapezoidal, fault=wrong_start))
    assert found["cause"] == "starting momentum"
    assert found["evidence"]["order_of_legendre"] == pytest.approx(2, abs=0.05)
    assert found["evidence"]["start"] > 1e-6


def test_newton_that_stops_too_early_is_told_by_what_it_leaves():
    found = cause(order("pendulum", midpoint, fault=loose))
    assert found["cause"] == "Newton"
    assert 1e-20 < found["evidence"]["residual_of_steps"] < 1e-3
    assert found["evidence"]["noise"] < 1e-28


@pytest.mark.parametrize("rule", ["midpoint", "triple-jump:midpoint", "blanes-moan-4:rectangle"])
def test_what_newton_leaves_is_seen_in_a_step_or_in_the_first_substep(rule, monkeypatch):
    flow = Scheme(scenes.get("kepler"), discretisations.get(rule)).flow("0.01", 30)
    assert residuals(flow)[0] < 1e-28
    sound = type(flow).trajectory

    def loosely(self, *asked):
        run = sound(self, *asked)
        return replace(run, u=run.u * (1 + flow.numbers.number("1e-7")))

    monkeypatch.setattr(type(flow), "trajectory", loosely)
    assert 1e-8 < residuals(flow)[0] < 1e-6


def test_a_wrong_reference_is_told_by_a_witness(monkeypatch):
    true = reference.solution

    def wrong(scene, t, digits=50, attitude=False):
        found = true(scene, t, digits, attitude)
        return replace(found, x=[e * (1 + Fraction(1, 10**6)).__float__() for e in found.x])

    monkeypatch.setattr("discmech.reference.solution", wrong)
    found = cause(order("kepler", midpoint))
    assert found["cause"] == "reference"
    assert 1e-8 < found["evidence"]["reference_gap"] < 1e-5
    assert found["evidence"]["witness_error"] < 1e-12


@pytest.mark.slow
def test_round_off_is_told_by_more_digits():
    scene = Scene(
        name="far-pendulum", groupoid=pair(1), parameters={"turns": 10**12}, x0=[1], v0=[0],
        lagrangian=lambda x, v, p: v[0] ** 2 / 2 + sympy.cos(x[0] + p.turns), duration=10,
        step="1/20",
    )  # fmt: skip
    found = cause(order(scene, midpoint, digits=16))
    assert found["cause"] == "round-off"
    assert found["evidence"]["order_at_50_digits"] == pytest.approx(2, abs=0.02)
    assert found["evidence"]["noise"] > 1e-12


def test_a_sound_rule_is_not_diagnosed():
    assert "diagnosis" not in run_case(get("order"), order("kepler", midpoint))


@pytest.mark.parametrize("name", ["pendulum", "rigid-body", "heavy-top", "wong"])
@pytest.mark.slow
def test_discrete_lagrangian_and_legendre_maps_have_one_order(name):
    """Marsden, West, theorem 2.3.1; at the order that the scheme has."""
    found = truncation(Scheme(scenes.get(name), midpoint))
    assert found.order == pytest.approx(2, abs=0.03)
    assert slope(found.steps, found.lagrangian) == pytest.approx(2, abs=0.1)


@pytest.mark.slow
def test_a_rule_that_is_not_consistent_is_not_advised_to_declare_its_order():
    @discretisation(order=2)
    def slip(L, G, x, u, h):
        return h * L(G.target(x, u, h / 2), 2 * u)

    found = cause(order("kepler", slip))
    assert found["cause"] == "discrete Lagrangian" and "not consistent" in found["sentence"]
    assert "declare" not in found["sentence"]
    assert found["evidence"]["order_of_legendre"] == pytest.approx(0, abs=0.05)


@pytest.mark.sampled
@pytest.mark.parametrize("scene", ["pendulum", "duffing"])  # of a force and the time too
@pytest.mark.parametrize(("formula", "factor", "rest"), [
    (lambda L, G, x, u, h: 2 * h * L(G.target(x, u, h / 2), u) / 3, "2/3", ""),
    (lambda L, G, x, u, h: h * (2 * L(x, u) + 3 * L(G.target(x, u, h), u)) / 4, "5/4",
     "not 2"),
    (lambda L, G, x, u, h: L(G.target(x, u, h / 2), u), "h^-1", ""),
    (lambda L, G, x, u, h: h**3 * L(x, u) / 2, "1/2·h^2", "divide it by h^2. Without it"),
])  # fmt: skip
def test_a_factor_is_named(scene, formula, factor, rest):
    found = cause(order(scene, discretisation(order=2, name="scaled")(formula)))
    assert found["cause"] == "factor" and f"L_d is {factor} times a consistent" in found["sentence"]
    assert rest in found["sentence"] and ("Without" in found["sentence"]) is bool(rest)


@pytest.mark.dear("[16]")
@pytest.mark.parametrize("digits", [16, 50])
def test_floats_that_fractions_were_meant_by_are_said_and_are_no_failure(digits):
    """The runs have the order; one small step has not, but for the last bits of the floats."""

    @discretisation(order=2)
    def thirds(L, G, x, u, h):
        ends = L(x, u) + L(G.target(x, u, h), u)
        return h * (1 / 6 * ends + 2 / 3 * L(G.target(x, u, h / 2), u))

    found = run_case(get("order"), replace(order("harmonic", thirds), digits=digits))
    assert found["verdict"] == "pass" and "errs by 7e-17 of its length" in found["reason"]
    assert {1 / 6, 2 / 3} <= set(found["local"]["floats"]["values"])


@pytest.mark.slow
def test_an_innocent_float_is_no_cause():
    """Beside an exact fault of 10⁻⁸ h²; a float of a fault is one that its last bits explain."""

    @discretisation(order=2)
    def decoy(L, G, x, u, h):
        middle = G.target(x, u, h / 2)
        potential = L(middle, 0 * u)
        return h * L(middle, u) + h**2 * potential / 10**8 + 0.1 * h**3 * potential

    found = cause(replace(order("pendulum", decoy), digits=50))
    assert found["cause"] == "discrete Lagrangian" and "O(h^2)" in found["sentence"]


@pytest.mark.slow
def test_points_a_little_off_the_middle_are_no_round_off():
    @discretisation(order=2)
    def beside(L, G, x, u, h):
        return h * L(G.target(x, u, (sympy.Rational(1, 2) + sympy.Rational(1, 10**6)) * h), u)

    found = cause(replace(order("pendulum", beside), digits=16))
    assert found["cause"] == "few digits" and "lies at 0.500001 of the step" in found["sentence"]


@pytest.mark.slow
def test_weights_that_sum_to_1_are_not_told_to():
    @discretisation(order=2)
    def slow(L, G, x, u, h):
        return h * L(G.target(x, u, h / 2), u * sympy.Rational(9, 10))

    found = cause(order("rigid-body", slow))
    assert "weights sum to 1, so what L is given for a velocity has to be one" in found["sentence"]


@pytest.mark.slow
def test_who_gives_velocities_of_the_chart_is_not_told_to():
    """The derivative of a curve of the stages has the wrong sign in s."""

    @discretisation(order=4, stages=1)
    def turned(L, G, x, u, h, s):
        total = 0
        for theta, weight in ((0, 1), (sympy.Rational(1, 2), 4), (1, 1)):
            w = theta * u + theta * (1 - theta) * s[0]
            dw = u - (1 - 2 * theta) * s[0]
            total += h * weight * L(G.target(x, w, h), G.velocity(x, w, dw, h)) / 6
        return total

    found = cause(order("rigid-body", turned))
    assert "its derivative dw" in found["sentence"] and "give L the" not in found["sentence"]


def test_an_order_of_nothing_has_no_sign():
    """Errors that stay had an order of "-0.000"."""
    measured = {"rows": [], "certain": 50, "measured": {"order": -1e-7}}
    told = get("order").judge(order("kepler", midpoint), measured)
    assert told.reason.startswith("order 0.000 is below")


@pytest.mark.slow
def test_a_scene_of_two_minds_is_told_as_such():
    """Its discrete Lagrangian on the group is that of another body than its Lagrangian."""
    body = scenes.get("moser-veselov").with_values(
        name="two-minds", lagrangian=lambda x, v, p: (2 * v.dot(v) + v[0] ** 2) / 2
    )
    found = cause(order(body, discretisations.own, steps=8))
    assert found["cause"] == "scene" and "none of its lagrangian" in found["sentence"]


@pytest.mark.slow
def test_a_factor_of_a_discrete_lagrangian_of_the_scene_is_told_as_one():
    """Its points are those of the scene's Lagrangian: it is no other."""
    body = scenes.get("moser-veselov")
    own = body.discrete_lagrangian
    longer = replace(own, formula=lambda x, g, h, p: 5 * own.formula(x, g, h, p) / 4)
    body = body.with_values(name="longer", discrete_lagrangian=longer)
    found = cause(order(body, discretisations.own, steps=8))
    assert found["cause"] == "factor" and "5/4" in found["sentence"]


@pytest.mark.slow
def test_a_velocity_of_coordinates_is_told_on_a_group():
    """Simpson's rule on a parabola with dw/dθ for a velocity: of order 4 on pairs alone."""

    @discretisation(order=4, stages=1)
    def parabola(L, G, x, u, h, s):
        points = ((sympy.Rational(k, 2), w) for k, w in enumerate((1, 4, 1)))
        return sum(
            h
            * sympy.Rational(w, 6)
            * L(G.target(x, t * u + t * (1 - t) * s[0], h), u + (1 - 2 * t) * s[0])
            for t, w in points
        )

    found = cause(order("rigid-body", parabola))
    assert found["cause"] == "velocity in the chart" and "G.velocity" in found["sentence"]
    assert found["evidence"]["order_on_a_pair_groupoid"] == pytest.approx(4, abs=0.1)


@pytest.mark.parametrize(("scene", "excess", "order_found"), [
    ("pendulum", -1, 0), ("pendulum", "h", 1),
    pytest.param("heavy-top", "h", 1, marks=pytest.mark.slow),
    pytest.param("heavy-top", -1, 0, marks=pytest.mark.slow),
])  # fmt: skip
def test_a_part_that_holds_no_velocity_is_told_by_the_equations(scene, excess, order_found):
    """h^{r+1} E(x) in L_d is O(h^{r+1}) in ‖F±/h − μ‖, as if the method were one order better."""

    @discretisation(order=2)
    def slip(L, G, x, u, h):
        factor = h if excess == "h" else excess
        return h * L(G.target(x, u, h / 2), u) + h * factor * L(x, 0 * u)

    found = cause(order(scene, slip, digits=50))
    assert found["cause"] == "discrete Lagrangian"
    assert ("not consistent" in found["sentence"]) is (order_found == 0)
    assert found["evidence"]["order_of_points"] == pytest.approx(order_found, abs=0.1)
    assert found["evidence"]["order_of_legendre"] == pytest.approx(order_found + 1, abs=0.1)


@pytest.mark.slow
def test_weights_whose_sum_is_not_one_are_told_on_a_group():
    """Momenta that were 7/6 of theirs beside points of order 2 were called a gauge."""

    @discretisation(order=2)
    def heavy(L, G, x, u, h):
        middle, end = (L(G.target(x, u, share), u) for share in (h / 2, h))
        return h * (L(x, u) + 4 * middle + 2 * end) / 6

    found = cause(order("heavy-top", heavy))
    assert found["cause"] == "factor" and "sum to 7/6" in found["sentence"]


def beginning(f, off, **more):
    z, zero = np.array([0.3, f[1]]), np.zeros(2)
    field = np.array(f)
    return Beginning(
        z, 0.0, field, second=zero, third=zero, of_time=zero, first_error=off, second_error=zero,
        third_error=zero, later=zero, parts={}, others={}, misread={},
        span=np.abs(field).max() * np.ones(2), moved=(zero, zero), square=zero, **more,
    )  # fmt: skip


@pytest.mark.parametrize(("shortest", "is_told"), [
    ([(4 * np.pi, 0.1), (0.0, 0.0)], True), ([(-2 * np.pi + 1e-5, 0.0), (1e-5, 0.0)], True),
    ([(0.0, 2 * np.pi), (0.0, 0.0)], False),  # a momentum has no turns
    ([(2 * np.pi, 0.0), (0.1, 0.0)], False), ([(np.pi, 0.0), (0.0, 0.0)], False),
])  # fmt: skip
def test_only_coordinates_off_by_whole_turns_are_wrapped(shortest, is_told):
    found = [beginning((1.0, 0.5), np.zeros(2), shortest=np.array(e)) for e in shortest]
    told = wrapped(found, 1)
    assert bool(told) is is_told and (not told or told[0] == "jumps of 2π")


@pytest.mark.dear("0.15")
@pytest.mark.parametrize("width", ["0.3", "0.15"])
def test_a_fault_in_a_part_of_the_states_is_told_with_the_place(width):
    """Its tail is a few digits along the motion, or nothing."""

    @discretisation(order=2)
    def bumpy(L, G, x, u, h):
        wrong = sympy.exp(-(((x[0] - sympy.Rational("2.2")) / sympy.Rational(width)) ** 2)) / 100
        first, second = (L(G.target(x, u, k * h / 3), u) for k in (1, 2))
        return h * (1 + wrong) * first / 2 + h * (1 - wrong) * second / 2

    pendulum = Scene("pend", pair(1), lambda x, v, p: v[0] ** 2 / 2 + 6 * sympy.cos(x[0]),
                     x0=["1.2"], v0=[0], duration=10, step="1/40")  # fmt: skip
    case = order(pendulum, bumpy, digits=50)
    local = evidence_of(case.scheme).order
    measured = Measurement.of_json({"local": {"order": local.order}})
    found = diagnosis.of_order(case, measured, case.scene.duration, lambda: None)
    assert local.order < 1.1 and f"at x = ({float(local.place.x[0]):.4g})" in found["sentence"]


@pytest.mark.parametrize("mean_of_wrapped", [False, True])
def test_a_mean_of_angles_on_both_sides_of_a_branch_is_told(mean_of_wrapped):
    rotor = Scene("rotor", pair(1), lambda x, v, p: v[0] ** 2 / 2 + sympy.cos(x[0]), x0=[0],
                  v0=["2.5"], duration=10, step="1/20")  # fmt: skip

    @black_box(order=2)
    def program(q, p, h, system):
        Q, P = q, p
        for _ in range(40):
            P = p - h * np.sin((q + Q) / 2)
            Q = q + h * (p + P) / 2
            Q = (Q + np.pi) % (2 * np.pi) - np.pi if mean_of_wrapped else Q
        return (Q + np.pi) % (2 * np.pi) - np.pi, P

    starts = [beginning((1.5, 1.5), np.zeros(2))]
    told = across(Case("order", rotor, program, 16), starts, 0)
    assert ("before the jump" in told) is mean_of_wrapped


@pytest.mark.parametrize(("off", "named"), [
    ((1, -1), "the method is of order 2"), ((0, 1), "L_d is 1.000002 times a consistent one"),
])  # fmt: skip
def test_a_small_fault_is_told_at_steps_that_show_it_alone(off, named):
    """At a quarter of the scene's step h^4 and 1e-6 h^2 are as large, and looked like a factor."""
    few, many = (e * sympy.Rational(1, 10**6) for e in off)

    @discretisation(order=4, stages=1)
    def eighths(L, G, x, u, h, s):
        total = 0
        weights = ("1/8", few), ("3/8", many), ("3/8", many), ("1/8", few)
        for k, (weight, more) in enumerate(weights):
            theta = sympy.Rational(k, 3)
            c, dc = theta * u + theta * (1 - theta) * s[0], u + (1 - 2 * theta) * s[0]
            at = G.target(x, c, h), G.velocity(x, c, dc, h)
            total += h * (sympy.Rational(weight) + more) * L(*at)
        return total

    told = cause(Case("order", scenes.get("pendulum"), eighths, 50, None))
    assert named in told["sentence"]


ATWOOD = Scene(
    "atwood", pair(2), lambda x, v, p: 2 * v[0] ** 2 + (x[0] * v[1]) ** 2 / 2
    - x[0] * (3 - sympy.cos(x[1])), x0=[1, "3/2"], v0=[0, 0], duration=5, step="1/50",
)  # fmt: skip


@pytest.mark.dear("12", "[7-pendulum-8]")
@pytest.mark.parametrize(("digits", "scene", "least"), [
    (7, "pendulum", 8), (12, "pendulum", 13), (17, "pendulum", 18),
    (4, ATWOOD, 7),  # it starts at rest, where errors are small
])  # fmt: skip
def test_a_node_of_few_digits_is_no_gauge_and_no_part_of_the_states(digits, scene, least):
    @discretisation(order=4, stages=1)
    def gauss(L, G, x, u, h, s):
        k = G.constant(lambda d: mpmath.mpf("0.28867513459481288225"[: 2 + digits]))
        total = 0
        for theta in (sympy.Rational(1, 2) - k, sympy.Rational(1, 2) + k):
            w, dw = theta * u + theta * (1 - theta) * s[0], u + (1 - 2 * theta) * s[0]
            total += h / 2 * L(G.target(x, w, h), G.velocity(x, w, dw, h))
        return total

    told = cause(order(scene, gauss, digits=50))
    assert told["cause"] == "discrete Lagrangian" and "too few digits" in told["sentence"]
    assert 10.0**-least < told["evidence"]["share"] < 100 * 10.0**-digits


def test_a_lower_order_in_a_narrow_part_is_no_other_field():
    """At the steps that are extrapolated its error is no polynomial in h."""

    @one_step_map(order=2, groupoids="pair")
    def narrow(s, z, h):
        x, mu = s.split(z)
        mu = mu + h / 2 * s.split(s.f(z))[1]
        x = x + h * s.split(s.f(s.join(x, mu)))[0]
        mu = mu + h / 2 * s.split(s.f(s.join(x, mu)))[1]
        lost = h**2 / 20 * sympy.exp(-(((x[0] + sympy.Rational(11, 10)) * 1000) ** 2))
        return s.join(x, mu * (1 - lost))

    told = cause(Case("order", scenes.get("pendulum"), narrow, 16, None))
    assert told is None or told["cause"] == "order conditions"


def test_a_small_fault_is_not_taken_for_a_factor_of_one():
    """A field that is off by 2e-6 was called one of too few digits, or a step of its own."""
    fields = [(1.0, 0.0), (0.5, 1.0), (-0.7, 2.0)]
    odd = [beginning(f, 2e-6 * np.array([0.0, f[1] ** 2])) for f in fields]
    assert first_terms.factor(odd, lambda b: b.first_error, lambda b: b.f) is None
    longer = [beginning(f, 2e-6 * np.array(f)) for f in fields]
    found = first_terms.factor(longer, lambda b: b.first_error, lambda b: b.f)
    assert found == pytest.approx(2e-6)


def test_newton_is_no_cause_where_the_order_is_there_or_errors_are_far_larger(monkeypatch):
    """As beside a processed rule that is inconclusive for its own reason."""
    case = order("harmonic", midpoint, digits=30)
    monkeypatch.setattr(diagnosis, "residuals", lambda flow: (2.9e-14, 1e-17))
    for found, error, wanted in ((1.9999, 1e-9, None), (1.0, 1e-2, None), (1.0, 1e-12, "Newton")):
        rows = [{"steps": n, "step": 1 / n, "error": error * 4, "used": True} for n in (32, 64)]
        told = diagnose(case, Measurement({"order": found}, rows, {"local": {"order": 2.0}}))
        assert (told and told["cause"]) == wanted
