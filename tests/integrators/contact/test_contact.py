"""Contact: closed forms, cones, many digits, every kind of rule, and what has no answer."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import mpmath
import numpy as np
import pytest
import sympy
from sympy import Rational

from discmech import (
    BadInput,
    Scene,
    Scheme,
    StepFailure,
    lie_group,
    midpoint,
    pair,
    so,
    trapezoidal,
)
from discmech.integrators import retractions, scenes
from discmech.integrators.contact.cones import scaling
from discmech.integrators.contact.impacts import active
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.rules import get

BALL = scenes.get("bouncing-ball")
BLOCK = scenes.get("sliding-block")


@cache
def scheme(name, rule=midpoint):
    return Scheme(scenes.get(name), rule)


@cache
def run(name, step, steps, impacts, rule=midpoint, digits=16):
    return scheme(name, rule).flow(step, digits, impacts=impacts).trajectory(steps)


def energies(name, found):
    """H at the rows, of scenes with a mass matrix of numbers."""
    from discmech.integrators.contact import Gaps
    from discmech.integrators.numbers import arithmetic

    gaps = Gaps(scheme(name).equations.s, scenes.get(name), arithmetic(16))
    return np.array([gaps.energy(x, gaps.velocity(x, mu, mu), mu)
                     for x, mu in zip(found.x, found.mu, strict=True)])  # fmt: skip


# -- closed forms ---------------------------------------------------------------------------------


@pytest.mark.parametrize("digits", [16, 30])
def test_impacts_of_a_ball_are_where_they_are(digits):
    found = run("bouncing-ball", "0.1", 80, "located", midpoint, digits)
    with mpmath.workdps(digits):
        wanted = [(2 * k + 1) * mpmath.sqrt(2) for k in range(3)]
        assert max(abs(t - w) for t, w in zip(found.impacts.t, wanted, strict=True)) < 10 ** (
            3 - digits
        )
        energy = found.mu[:, 0] ** 2 / 2 + found.x[:, 0]
        assert max(abs(energy - 1)) < mpmath.mpf(10) ** (2 - digits)
    assert (found.gaps >= 0).all()


def test_stepped_impacts_are_late_by_less_than_a_step_and_keep_the_energy():
    found = run("bouncing-ball", "0.01", 800, "stepped")
    late = found.impacts.t - np.sqrt(2) * np.array([1, 3, 5])
    assert (np.diff([0, *late]) > 0).all() and (np.diff([0, *late]) < 0.01).all()
    assert abs(found.mu[:, 0] ** 2 / 2 + found.x[:, 0] - 1).max() < 1e-14
    assert found.gaps.min() >= -1e-15


@pytest.mark.parametrize("impacts", ["stepped", "located"])
@pytest.mark.parametrize("e", ["0.5", 0])
def test_a_ball_comes_to_rest(impacts, e):
    flow = scheme("bouncing-ball").at(restitution=e).flow("0.02", impacts=impacts)
    found = flow.trajectory(260)
    assert abs(found.x[-1, 0]) < 1e-15 and abs(found.mu[-1, 0]) < 1e-15
    assert found.gaps.min() >= -1e-15 and abs(found.multipliers[-2, 0] - 1) < 1e-13
    if impacts == "located":
        half = float(flow.scheme.scene.restitution)
        flights = 2 * np.sqrt(2) * half ** np.arange(1, 5)
        wanted = np.sqrt(2) + np.cumsum([0, *flights])
        count = len(wanted) if half else 1
        assert abs(found.impacts.t[:count] - wanted[:count]).max() < 1e-12


@pytest.mark.parametrize(("impacts", "digits"), [("located", 16), ("stepped", 16), ("located", 30)])
def test_a_block_slides_to_rest(impacts, digits):
    found = run("sliding-block", "0.1", 60, impacts, midpoint, digits)
    wanted = mpmath.mpf("2.5")
    assert abs(found.x[-1, 0] - wanted) < (10 ** (3.5 - digits) if impacts == "located" else 3e-3)
    assert abs(found.mu[-1]).max() == 0 and abs(found.x[-1] - found.x[-3]).max() == 0
    assert abs(found.multipliers[:-1, 0] - mpmath.mpf("0.96")).max() < 1e-13
    sliding, resting = found.impulses[2, 0], found.impulses[-2, 0]
    assert abs(sliding[1] / sliding[0] + 0.5) < 1e-13  # Coulomb's cone, against the slip
    assert abs(resting[1] + mpmath.mpf("0.028")) < 1e-13  # what holds it on the slope


def test_a_block_on_a_steep_slope_slides_on():
    found = Scheme(BLOCK.with_values(friction="0.1"), trapezoidal).flow("0.1").trajectory(40)
    rate = 0.28 - 0.1 * 0.96
    assert abs(found.x[-1, 0] - (4 + rate * 8)) < 1e-12


# -- orders ---------------------------------------------------------------------------------------

SPRING = Scene(
    "spring-and-wall",
    pair(1),
    lambda x, v, p: (v[0] ** 2 - x[0] ** 2) / 2,
    x0=[1],
    v0=[0],
    contact=lambda x, p: [x[0] + Rational(1, 2)],
    restitution=1,
    impacts="located",
)


@pytest.mark.parametrize(
    ("rule", "order"), [("midpoint", 2), ("gauss-2", 4), ("implicit-midpoint", 2)]
)
def test_located_impacts_have_the_order_of_the_rule(rule, order):
    made = Scheme(SPRING, get(rule))
    wanted = (np.pi - np.arccos(0.5)) * np.array([1, 3])
    off = [abs(made.flow(h).trajectory(n).impacts.t - wanted).max()
           for h, n in (("0.2", 33), ("0.1", 66))]  # fmt: skip
    assert abs(np.log2(off[0] / off[1]) - order) < 0.2


def test_stepped_impacts_have_order_one():
    wanted = (np.pi - np.arccos(0.5)) * np.array([1, 3])
    made = Scheme(SPRING, midpoint)
    for step in (0.02, 0.01, 0.005):
        found = made.flow(step, impacts="stepped").trajectory(round(6.6 / step))
        assert abs(found.impacts.t - wanted).max() < 3 * step


def test_a_puck_that_turns_under_friction_has_order_two():
    puck = Scene(
        "puck", pair(3), lambda x, v, p: v.dot(v) / 2 - x[2] - (x[0] ** 2 + 2 * x[1] ** 2) / 2,
        x0=[1, "0.5", 0], v0=[0, 1, 0], contact=lambda x, p: [x[2]], friction="0.1",
    )  # fmt: skip
    made = Scheme(puck, midpoint)
    ends = [made.flow(h).trajectory(n).x[-1] for h, n in (("0.1", 20), ("0.05", 40), ("0.025", 80))]
    ratio = abs(ends[1] - ends[0]).max() / abs(ends[2] - ends[1]).max()
    assert abs(np.log2(ratio) - 2) < 0.15


def test_a_frictionless_bowl_is_a_constraint():
    """A contact that never opens is the constrained step, RATTLE where the rule is trapezoidal."""
    shared = dict(x0=["0.6", "-0.8"], v0=[0, 0])

    def lagrangian(x, v, p):
        return v.dot(v) / 2 - x[1]

    bowl = Scene("bowl", pair(2), lagrangian, contact=lambda x, p: [1 - x.dot(x)], **shared)
    held = Scene("held", pair(2), lagrangian, holonomic=lambda x, p: [1 - x.dot(x)], **shared)
    ours, theirs = (Scheme(s, trapezoidal).flow("0.05").trajectory(60) for s in (bowl, held))
    assert abs(ours.x - theirs.x).max() < 1e-14 and abs(ours.mu - theirs.mu).max() < 1e-14


# -- several contacts -----------------------------------------------------------------------------


@pytest.mark.parametrize("impacts", ["stepped", "located"])
@pytest.mark.parametrize(
    "name",
    [
        "falling-stick",
        "wedge-billiard",
        "beads",
        pytest.param("tumbling-box", marks=pytest.mark.slow),
    ],
)
def test_gaps_stay_open_and_energy_does_not_rise(name, impacts):
    scene = scenes.get(name)
    found = run(name, scene.step, 60, impacts)
    assert found.gaps.min() >= -1e-13
    assert (found.multipliers >= -1e-13).all()
    energy = energies(name, found)
    band = 2e-13 if name != "beads" and name != "tumbling-box" else 2e-3
    assert np.diff(energy).max() < band
    kappa = float(scene.friction)
    pushes = found.impulses
    if kappa:
        assert (np.linalg.norm(pushes[:, :, 1:], axis=2) <= kappa * pushes[:, :, 0] + 1e-13).all()
    jumps = found.impacts
    before, after = np.array(jumps.before), np.array(jumps.after)
    assert jumps.t.size and (before != after).any(axis=1).all()


def test_at_rest_on_two_ends_with_friction():
    """Redundant contacts: the impulses are not unique, the motion is."""
    stick = scenes.get("falling-stick").with_values(x0=[0, 0, 0], v0=["0.2", 0, 0])
    found = Scheme(stick, midpoint).flow("0.05", impacts="located").trajectory(30)
    assert abs(found.x[-1, 0] - 0.2**2 / (2 * 0.3)) < 1e-13
    assert abs(found.mu[-1]).max() < 1e-15


def test_one_step_maps_and_forces_have_contact_too():
    def lagrangian(x, v, p, t):
        return v[0] ** 2 / 2 - x[0] * (1 + sympy.cos(t) / 10)

    ball = Scene("driven", pair(1), lagrangian, x0=[1], v0=[0], contact=lambda x, p: [x[0]],
                 force=lambda x, v, p, t: [-v[0] / 10], restitution="0.8")  # fmt: skip
    ends = [Scheme(ball, rule).flow("0.01", impacts="located").trajectory(300).x[-1, 0]
            for rule in (midpoint, trapezoidal)]  # fmt: skip
    assert abs(ends[0] - ends[1]) < 1e-4
    found = Scheme(BALL, get("implicit-midpoint")).flow("0.1").trajectory(40)
    assert abs(found.impacts.t - np.sqrt(2) * np.array([1])).max() < 1e-12


def test_nothing_is_compiled_for_contact():
    free = BALL.with_values(contact=None)
    assert (free.friction, free.restitution, free.impacts) == (0, 0, "stepped")
    ours, theirs = (Scheme(s, midpoint).flow("0.1").system for s in (BALL, free))
    for part in ("rows", "slope", "increment", "gain", "definitions", "q", "w"):
        assert getattr(ours, part) == getattr(theirs, part)
    assert type(Scheme(free, midpoint).flow("0.1")).__name__ == "Flow"


def test_rows_and_starts():
    flow = scheme("bouncing-ball").flow("0.1")
    whole, every = flow.trajectory(40), flow.trajectory(40, 4)
    assert (whole.x[::4] == every.x).all() and len(every.impacts.t) == len(whole.impacts.t)
    again = flow.trajectory(20, x0=whole.x[20], mu0=whole.mu[20])
    assert abs(again.x[-1] - whole.x[40]).max() < 1e-13
    struck = flow.trajectory(3, x0=[0], mu0=[-1])  # it begins with an impact
    assert struck.impacts.t[0] == 0 and struck.mu[0, 0] == -1 and struck.mu[1, 0] > 0.8
    assert abs(flow.dual_step([1], [0])[0][0] - 0.995) < 1e-15
    assert whole.impulses.shape == (41, 1, 1)  # no friction, no plane
    assert flow.ensemble([[1], [2]], [[0], [0]], 10).x.shape == (2, 11, 1)


@pytest.mark.parametrize("impacts", ["stepped", "located"])
def test_a_run_goes_on_from_any_of_its_rows(impacts):
    """At rest φ is a round-off of where it came from, of either sign: no start inside."""
    for name, e in (("bouncing-ball", "0.5"), ("sliding-block", 0)):
        flow = scheme(name).at(restitution=e).flow("0.05", impacts=impacts)
        found = flow.trajectory(130)
        for k in (60, 100, 128):
            again = flow.trajectory(130 - k, x0=found.x[k], mu0=found.mu[k])
            assert abs(again.x[-1] - found.x[-1]).max() < 1e-13


@pytest.mark.parametrize("impacts", ["stepped", "located"])
def test_after_an_impact_the_search_for_a_velocity_starts_at_the_new_one(impacts):
    """A relativistic ball: Newton's method that starts at the old velocity finds no numbers."""
    fast = Scene("fast", pair(1), lambda x, v, p: -sympy.sqrt(1 - v[0] ** 2) - x[0], x0=[1],
                 v0=[0], contact=lambda x, p: [x[0]], restitution="0.5")  # fmt: skip
    found = Scheme(fast, midpoint).flow("0.01", impacts=impacts).trajectory(240)
    energy = np.sqrt(1 + found.mu[:, 0] ** 2) + found.x[:, 0]
    assert abs(found.impacts.t[0] - np.sqrt(3)) < 0.01 and np.diff(energy).max() < 1e-7


@pytest.mark.parametrize(("e", "kappa"), [("1", 0), ("0.5", 0), ("1", "0.3")])
def test_impacts_gain_no_energy_where_the_momentum_is_not_affine_in_the_velocity(e, kappa):
    """(1 + e) times the impulse for e = 0 would: from 4.85 by more than 1 at e = 1."""
    stiff = Scene(
        "stiff", pair(2), x0=[0, 1], v0=[1, -1], restitution=e, friction=kappa,
        lagrangian=lambda x, v, p: (
            v.dot(v) / 2 + (v[0] + 2 * v[1]) ** 4 / 4 + v[0] ** 4 - x[1] / 10
        ),
        contact=lambda x, p: [x[1]],
    )  # fmt: skip
    flow = Scheme(stiff, midpoint).flow("0.05")
    jumps, gaps = flow.trajectory(22).impacts, flow.gaps
    assert len(jumps.t) == 1
    x, moments = jumps.x[0], (jumps.before[0], jumps.after[0])
    before, after = (gaps.velocity(x, mu, np.zeros(2)) for mu in moments)
    gain = gaps.energy(x, after, moments[1]) - gaps.energy(x, before, moments[0])
    assert gain < 1e-14
    kept = (e, kappa) == ("1", 0)  # here −e U⁻ has more energy than there is
    assert abs(gain if kept else after[1] + float(e) * before[1]) < 1e-13


def test_a_gap_whose_impacts_accumulate_leaves_the_others_their_rebound():
    """Ball 0 has bounced out by t = 1; ball 1 comes at t = 1.2, within the same step."""
    two = Scene("two-balls", pair(2), lambda x, v, p: v.dot(v) / 2 - 50 * x[0], x0=["0.01", "1.2"],
                v0=[0, -1], contact=lambda x, p: list(x), restitution="0.8",
                impacts="located")  # fmt: skip
    found = Scheme(two, midpoint).flow("1.5").trajectory(1)
    assert len(found.impacts.t) > 64 and found.mu[-1, 0] == 0
    assert abs(found.mu[-1, 1] - 0.8) < 1e-13 and abs(found.x[-1, 1] - 0.24) < 1e-13


@pytest.mark.parametrize("retraction", ["cayley", "exponential"])
def test_contact_on_an_action_groupoid(retraction):
    """A spherical pendulum that hits a plate: its attitude stays on the sphere."""
    top = scenes.get("spherical-pendulum").with_retraction(retractions.get(retraction))
    top = top.with_values(contact=lambda x, p: [x[2] + Rational(7, 10)], restitution=1)
    found = Scheme(top, midpoint).flow("0.02", impacts="located").trajectory(100)
    assert len(found.impacts.t) == 2 and found.gaps.min() > -1e-15
    assert abs(np.linalg.norm(found.x, axis=1) - 1).max() < 1e-14
    assert abs(np.linalg.norm(found.impacts.before - found.impacts.after, axis=1)).min() > 0.1


def test_friction_that_jams_is_said():
    """Painlevé's rod: an impulse at an end that slips would close its gap."""
    rod = scenes.get("falling-stick").with_values(
        x0=[0, 1, 1], v0=[0, 0, 0], friction=5, parameters={"inertia": "1/100"}
    )
    gaps = Scheme(rod, midpoint).flow("0.02").gaps
    place = gaps.at(np.array([0, np.sin(1), 1]))
    jams = []
    for along in (1.0, -1.0):
        on = active(gaps, place, [1], (), {1: np.array([along])})
        W = gaps.flexibility(place.x, np.zeros(3), on.rows, on.push)
        jams.append(W[0, 0] <= 0)
        if jams[-1]:
            with pytest.raises(CannotMeasure, match="jams"):
                scaling(W, on.cones)
    assert sorted(jams) == [False, True]


def test_a_gap_that_is_missed_between_two_steps_is_found():
    """A parabola that dips below the ground inside one step, located."""
    shot = Scene("shot", pair(2), lambda x, v, p: v.dot(v) / 2, x0=[-1, 0], v0=[1, 0],
                 contact=lambda x, p: [x[0] ** 2 - Rational(1, 900) + x[1]],
                 restitution=1, impacts="located")  # fmt: skip
    found = Scheme(shot, midpoint).flow("0.7").trajectory(2)
    assert len(found.impacts.t) == 1 and abs(found.impacts.t[0] - (1 - 1 / 30)) < 1e-10


# -- what has no answer ---------------------------------------------------------------------------


def ball(**given):
    values = dict(name="ball", groupoid=pair(1), lagrangian=lambda x, v, p: v.dot(v) / 2 - x[0],
                  x0=[1], v0=[0], contact=lambda x, p: [x[0]]) | given  # fmt: skip
    return Scheme(Scene(**values), midpoint).flow("0.1")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"x0": ["-0.25"]}, "inside the obstacle: gap 0 is -0.25; begin outside, such as"),
        ({"contact": lambda x, p: [x[0] - 1, -x[0]], "x0": ["0.5"]}, "contradict each other: no"),
        ({"contact": lambda x, p: [x[0], -x[0]], "x0": [0]}, "0, 1 contradict each other"),
        ({"restitution": "1.5"}, "restitution from 0 to 1"),
        ({"restitution": -1}, "restitution from 0 to 1"),
        ({"restitution": ["0.5"]}, "restitution from 0 to 1"),
        ({"friction": -1}, "friction is negative"),
        ({"friction": "0.5"}, "no plane of contact"),
        ({"friction": [0, 1]}, "one for each gap, 1"),
        ({"contact": lambda x, p: []}, "must give a list of gaps"),
        ({"contact": lambda x, p: x[0]}, "must give a list of gaps"),
        ({"contact": lambda x, p: {x[0]: 0}}, "must give a list of gaps"),
        ({"contact": lambda x, p: [(x[0], [])]}, "give φ, or"),
        ({"contact": lambda x, p: [sympy.Symbol("z")]}, "unknown symbol z"),
        ({"contact": lambda x, p: [p.depth]}, "depth"),
        ({"contact": lambda x, p: [1]}, "no motion changes"),
        ({"contact": lambda x, p: [x[0] ** 2], "x0": [0]}, "no slope there"),
        ({"contact": lambda x, p: [sympy.log(x[0] - 2)]}, "no real value"),
        ({"contact": 3}, "give a function of"),
        ({"impacts": "never"}, "stepped"),
        ({"contact": None, "friction": -3}, "friction=-3 needs contact="),
        ({"contact": None, "restitution": "0.5"}, "restitution='0.5' needs contact="),
        ({"contact": None, "impacts": "foo"}, "impacts='foo' needs contact="),
        ({"holonomic": lambda x, p: [x[0] - 1]}, "no constraints"),
        ({"groupoid": lie_group(so(3)), "x0": [], "v0": [1, 0, 0]}, "must have one"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_said_in_a_sentence(given, words):
    with pytest.raises(BadInput, match=words.replace("(", "\\(")) as refused:
        ball(**given)
    assert str(refused.value).endswith(".") and "\n" not in str(refused.value)


def test_a_tolerance_needs_located_impacts():
    """Stepped, runs of an elastic ball agree at the times that are compared, and are wrong."""
    with pytest.raises(BadInput, match="say impacts="):
        scheme("bouncing-ball").flow(tolerance="1e-3", impacts="stepped")
    made = Scheme(SPRING.with_values(duration=4), get("gauss-2"))
    flow = made.flow(tolerance="1e-4")
    assert flow.choice.order == 2 and flow.choice.error <= 1e-4
    end = flow.trajectory(flow.choice.steps).x[-1, 0]  # reflected at −1/2, at t = 2π/3
    assert abs(end - np.cos(4 - 2 * np.pi / 3 + 4 * np.pi / 3)) < 1e-4


def test_a_gap_that_no_motion_on_the_groupoid_changes():
    """The length of a point on a sphere has a slope, but not along the sphere."""
    top = scenes.get("spherical-pendulum")
    with pytest.raises(BadInput, match="closed at x0 and no motion on"):
        Scheme(top.with_values(contact=lambda x, p: [x.dot(x) - 1]), midpoint)


def test_a_column_of_gaps_is_a_list():
    columns = ball(contact=lambda x, p: sympy.Matrix([x[0], x[0] + 1])).trajectory(3)
    assert columns.gaps.shape == (4, 2)
    slipping = ball(contact=lambda x, p: [(x[0], sympy.Matrix([x[0]]))], friction="0.5")
    assert slipping.trajectory(3).impulses.shape == (4, 1, 2)


def test_what_a_flow_with_contact_has_not():
    flow = ball()
    made = flow.scheme
    for asked in (lambda: flow.evolve([1], [1]), lambda: flow.pullback_defect([1], [1]),
                  lambda: flow.poisson_defect([1], [1])):  # fmt: skip
        with pytest.raises(CannotMeasure, match="contact"):
            asked()
    for asked in (lambda: made.flow("-0.1"), lambda: made.flow("0.1", on_edge="shrink"),
                  lambda: flow.trajectory(3, x0=[-1], mu0=[0]),
                  lambda: flow.trajectory(3, element0=[[1]]),
                  lambda: made.flow("0.1", impacts="never"),
                  lambda: Scheme(scenes.get("harmonic"), midpoint).flow("0.1", impacts="located"),
                  lambda: made.at(contact=lambda x, p: [x[0] + 1])):  # fmt: skip
        with pytest.raises(BadInput):
            asked()


def test_a_failure_keeps_its_rows():
    """A potential that ends: the ball reaches log(0) before the ground."""

    def lagrangian(x, v, p):
        return v.dot(v) / 2 - 9 * x[0] + sympy.log(x[0] - Rational(1, 2))

    with pytest.raises(StepFailure) as failed:
        ball(lagrangian=lagrangian, x0=["0.6"], v0=[-3]).trajectory(400)
    rows = failed.value.trajectory
    assert len(rows.x) == failed.value.step_index >= 1 and rows.gaps.min() > 0


@pytest.mark.slow
def test_a_hundred_thousand_impacts_lose_no_energy():
    found = Scheme(BALL.with_values(x0=["0.02"]), midpoint).flow("0.1").trajectory(401_000, 997)
    assert len(found.impacts.t) >= 100_000
    energy = found.mu[:, 0] ** 2 / 2 + found.x[:, 0]
    assert abs(energy / 0.02 - 1).max() < 1e-10


def test_a_scene_with_contact_is_explained(capsys):
    from discmech.studies.command.entry import main

    assert main(["explain", "sliding-block", "midpoint"]) == 0
    shown = capsys.readouterr().out
    for words in ("0 ≤ x₂", "friction 1/2, restitution 0, impacts located", "of the first 20"):
        assert words in shown


def test_the_page_of_contact_runs():
    text = (Path(__file__).parents[3] / "docs" / "contact.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    found = {}
    exec(compile(block, "docs/contact.md", "exec"), found)
    assert found["run"].gaps.min() >= 0 and len(found["run"].impacts.t) == 2
