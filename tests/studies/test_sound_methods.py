"""Sound methods that a study may stumble over: none of them is failed."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy

from discmech.integrators import (
    Conserved,
    Scene,
    Scheme,
    action,
    discretisation,
    one_step,
    pair,
    rules,
    scenes,
    so,
)
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.scene import on_group
from discmech.reference import solution
from discmech.studies.causes import round_off
from discmech.studies.causes.round_off import lost_one_way, measure_round_off
from discmech.studies.core.case import Case
from discmech.studies.core.records import decoded
from discmech.studies.order.records import Row
from discmech.studies.order.window import departure, is_bent
from discmech.tests.bench.charts.measuring import measure as measure_charts
from tests.studies.cached_results import case, measured


@discretisation(order=2, stages=1, groupoids="pair")
def by_midway_points(L, G, x, u, h, s):
    """Half a step to a point s and half a step on (Marsden, West, 2.5): s is a position, and
    (s − x)/h a difference of nearly equal numbers."""
    near, far = ((x + s[0]) / 2, 2 * (s[0] - x) / h), ((s[0] + x + h * u) / 2, 2 * u)
    there = (far[0], far[1] - 2 * (s[0] - x) / h)
    return h / 2 * (L(*near) + L(*there))


ON_LINE = scenes.get("harmonic")


@pytest.mark.slow
def test_round_off_that_grows_as_steps_get_shorter_is_no_other_order():
    found = measured("order", ON_LINE, by_midway_points, 16)
    assert found["verdict"] == "pass" and found["measured"]["points"] >= 4
    left_out = [row for row in found["rows"] if row["why_not"] == "round-off"]
    assert left_out and all(
        is_bent(case("order", ON_LINE, by_midway_points), decoded(Row, r)) for r in left_out
    )


def test_a_motion_that_amplifies_round_off_is_no_other_order():
    """Into a saddle point: x = e⁻ᵗ, beside which round-off grows as eᵗ."""
    saddle = Scene("saddle", pair(1), lambda x, v, p: (v[0] ** 2 + x[0] ** 2) / 2,
                   x0=[1], v0=[-1], step="0.1", duration=10)  # fmt: skip
    found = measured("order", saddle, by_midway_points, 16)
    assert found["verdict"] == "inconclusive" and found["local"]["order"] > 1.9


@one_step(order=2, implicit=True)
def damped_map(s, z, Z, h):
    return Z - z - h * s.f((z + Z) / 2) + h**2 * z / 10**6


@discretisation(order=2)
def lopsided(L, G, x, u, h):
    more = sympy.Rational(1, 1000)
    return h * ((1 + more) * L(x, u) + (1 - more) * L(G.target(x, u, h), u)) / 2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "rule"), [("pendulum", damped_map), ("cartesian-pendulum", lopsided)]
)
def test_round_off_of_maps_and_of_constraints_is_measured_and_excuses_no_other_order(scene, rule):
    found = measured("order", scene, rule, 16)
    assert found["verdict"] == "fail" and found["reason"].startswith("the local order goes away")
    assert all(0 < row["round_off"] < 1e-10 for row in found["rows"])


def test_a_drift_of_lost_digits_is_no_failure():
    found = measured("energy", scenes.get("harmonic"), by_midway_points, 16, 4000)
    assert found["verdict"] == "inconclusive" and "nearly equal numbers" in found["reason"]


@pytest.mark.slow
def test_the_walk_of_a_momentum_counts_digits_that_a_step_loses():
    """They are measured at drawn states, and the drift is far beyond a walk without them."""
    found = measured("momentum", scenes.get("kepler"), by_midway_points, 16, 1000)
    drift = found["measured"]["drift"]["angular momentum"]
    assert found["verdict"] == "pass" and drift > 50 * found["expected"]["random_walk"]


@pytest.mark.slow
def test_plain_rules_lose_no_digits():
    """So that no drift of theirs is excused: a wrong quantity, and an explicit step."""
    wrong = Conserved("wrong", lambda x, mu, p: mu[0] + x[0] / 10**10)
    kepler = scenes.get("kepler").with_values(symmetries=[wrong])
    assert measured("momentum", kepler, rules.midpoint, 16, 200)["verdict"] == "fail"
    for name in ("kepler", "heavy-top", "double-pendulum", "fpu"):
        assert lost_one_way(case("momentum", name), 10**6) == 0


def test_what_maps_lose_is_held_against_a_drift_whole(monkeypatch):
    """If it is round-off over h; what does not grow as steps get shorter is for the walk."""
    of, eps = case("momentum", scenes.get("pendulum")), 2.0**-53
    for grown, lost in ((1, 0.0), (7, 0.0), (9, 2 * 1000 * 20 * eps), (64, 2 * 1000 * 20 * eps)):
        told = iter([(0.0, 20 * eps), (0.0, 20 * grown * eps)])
        monkeypatch.setattr(round_off, "residuals", lambda _, told=told: next(told))
        assert lost_one_way(of, 1000) == lost


def test_what_a_map_lacks_is_said_and_is_no_failed_step():
    step = Scheme(scenes.get("pendulum"), damped_map).flow("0.1").context
    with pytest.raises(CannotMeasure):
        step.maps_at(*step.vectors([1], [0]))


def test_errors_above_what_round_off_can_do_still_depart():
    """Local orders of 0.9, 0.7, 0.5 at 10⁻⁶, where F± are right to round-off."""
    of = case("order", ON_LINE)
    rows = [Row(100 * 2**k, 0.1 / 2**k, e)
            for k, e in enumerate((8e-6, 4.2e-6, 2.4e-6, 1.5e-6, 1.1e-6))]  # fmt: skip
    assert departure(of, rows, 30)
    rows = measure_round_off(of, rows, Fraction(10), solution(ON_LINE, 10))
    assert all(0 < row.round_off < 1e-10 for row in rows)
    assert departure(of, rows, 30)


def test_round_off_of_a_run_is_its_distance_from_one_with_more_digits(monkeypatch):
    """Of longer runs than `MOST_STEPS` it is that of the longest measured, as steps squared."""
    of, exact = case("order", ON_LINE), solution(ON_LINE, 10)
    ends = []
    for digits in (16, round_off.MORE_DIGITS):
        run = of.scheme.flow("0.1", digits).trajectory(100)
        ends.append([mpmath.mpf(run.x[-1][0]), mpmath.mpf(run.mu[-1][0])])
    whole = mpmath.hypot(exact.x[0], exact.mu[0])
    off = mpmath.hypot(*(a - b for a, b in zip(*ends, strict=True))) / whole
    monkeypatch.setattr(round_off, "MOST_STEPS", 100)
    rows = [Row(n, 10 / n, 1e-6) for n in (50, 100, 200)]
    made = [row.round_off for row in measure_round_off(of, rows, Fraction(10), exact)]
    assert made[1] == pytest.approx(float(off), rel=1e-6)
    assert made[2] == pytest.approx(4 * max(made[:2]), rel=1e-12)


def test_a_step_is_solved_as_well_as_its_maps_can_be_evaluated():
    """For a sum of a few terms that is a few roundings, of doubles and of 34 digits more."""
    flow = case("order", ON_LINE).scheme.flow("0.1")
    residual, noise = round_off.residuals(flow)
    assert 0 < residual < 64 * round_off.unit(16) and 0 < noise < 64 * 2.0**-53
    assert round_off.size(np.zeros((2, 1))) == 1.0 and round_off.unit(50) == 1e-50


def top(x, g, h, p):
    """tr(Λ(e − g))/h − h w x₃, a discrete Lagrange top; Λ = (1, 1, 3)/4."""
    turning = (1 - g[0, 0]) + (1 - g[1, 1]) + 3 * (1 - g[2, 2])
    return turning / 4 / h - h * p.weight * x[2]


TOP = Scene(
    "discrete-top", action(so(3)), parameters={"weight": "3/2"}, discrete_lagrangian=on_group(top),
    x0=["3/5", 0, "4/5"], mu0=["0.3", "0.1", "2"], step="0.1", duration=10,
    symmetries=[
        Conserved("about gravity", lambda x, mu, p: x.dot(mu)),
        Conserved("about the axis", lambda x, mu, p: mu[2]),
        Conserved("|Γ|²", lambda x, mu, p: x.dot(x), kind="Casimir"),
    ],
)  # fmt: skip


def second_integral(x, mu, p):
    """μ·Λ²μ, Λ = tr(I)/2 e − I (Moser, Veselov)."""
    half = sum(p.inertia) / 2
    return sum((half - p.inertia[i]) ** 2 * mu[i] ** 2 for i in range(3))


BODY = scenes.get("moser-veselov").with_values(
    name="integrable-body", symmetries=[Conserved("second", second_integral, kind="Casimir")]
)


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene", [pytest.param(TOP, id="top"), pytest.param(BODY, marks=pytest.mark.slow, id="body")]
)
def test_an_integrable_discrete_top_keeps_its_integrals_over_a_million_steps(scene):
    found = measured("momentum", scene, "own", 16, 10**6)
    assert found["verdict"] == "pass"


@pytest.mark.slow
def test_charts_ends_where_a_discrete_top_has_no_step():
    """Gravity moves starts to momenta that no step has: an answer, and no traceback."""
    found = measure_charts(Case("charts", TOP, rules.own, 16, 20))
    assert found["measured"]["stopped"]
    assert all(row["outcome"] == "ran" or row["solutions"] == 0 for row in found["rows"])


def test_a_rule_of_pairs_is_refused_elsewhere_and_not_failed():
    found = measured("order", "rigid-body", by_midway_points, 16)
    assert found["verdict"] == "inconclusive" and "exists on pair groupoids only" in found["reason"]
