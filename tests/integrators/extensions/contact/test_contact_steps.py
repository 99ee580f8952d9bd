"""Contact: several at once, every kind of rule and groupoid, runs from any row."""

import numpy as np
import pytest
import sympy
from sympy import Rational

from discmech import Scene, Scheme, midpoint, pair, trapezoidal
from discmech.integrators import retractions, scenes
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.extensions.contact.cones import scaling
from discmech.integrators.extensions.contact.impacts import active
from discmech.integrators.rules import get
from discmech.studies.contact.laws import defects, energies
from tests.integrators.extensions.contact.motions import BALL, run, scheme


@pytest.mark.sampled
@pytest.mark.parametrize("impacts", ["stepped", "located"])
@pytest.mark.parametrize("name", [
    "falling-stick",
    "wedge-billiard",
    "beads",
    "impacting-double-pendulum",
    pytest.param("tumbling-box", marks=pytest.mark.slow),
])  # fmt: skip
def test_the_laws_of_contact_hold(name, impacts):
    found = run(name, scenes.get(name).step, 60, impacts)
    laws = defects(scheme(name), found, 16)
    assert found.impacts.t.size and max(laws.values()) < 1e-11, laws
    kept = ("falling-stick", "wedge-billiard")  # by midpoint between impacts
    assert np.diff(energies(scheme(name), found, 16)[0]).max() < (2e-13 if name in kept else 2e-3)


def test_at_rest_on_two_ends_with_friction():
    """Redundant contacts: the impulses are not unique, the motion is."""
    stick = scenes.get("falling-stick").with_values(x0=[0, 0, 0], v0=["0.2", 0, 0])
    found = Scheme(stick, midpoint).flow("0.05", impacts="located").trajectory(30)
    assert abs(found.x[-1, 0] - 0.2**2 / (2 * 0.3)) < 1e-13
    assert abs(found.mu[-1]).max() < 1e-15


@pytest.mark.dear("located")
@pytest.mark.parametrize("impacts", ["stepped", "located"])
def test_a_box_that_turns_on_a_face_comes_to_rest(impacts):
    """Four corners that stick have to do so at once, which no frozen system of them allows."""
    box = scenes.get("tumbling-box").with_values(
        x0=[0, 0, "0.8", 1, 0, 0, 0, 1, 0, 0, 0, 1], v0=["0.2", "0.1", 0, 0, 0, "0.3"]
    )
    found = Scheme(box, midpoint).flow(box.step, impacts=impacts).trajectory(60)
    assert abs(found.mu[-1]).max() < 1e-15 and abs(found.gaps[:, [1, 3, 5, 7]]).max() < 1e-14


def test_nothing_pulls_where_two_corners_land_in_one_step():
    """With e < 1 no more is given back than was pushed, whatever the energy of the free step is."""
    box = scenes.get("tumbling-box").with_values(
        v0=["-0.09", "0.28", "0.54", "1.41", "-1.14", "0.37"], friction="0.7", restitution="0.2"
    )
    found = Scheme(box, midpoint).flow(box.step, impacts="stepped").trajectory(86)
    assert found.impulses[:, :, 0].min() >= -1e-15


@pytest.mark.slow
@pytest.mark.parametrize(("name", "count", "steps"), [
    ("falling-stick", 20, 600), ("tumbling-box", 10, 400),
])  # fmt: skip
def test_random_starts_run_to_rest(name, count, steps):
    random, scene = np.random.default_rng(1), scenes.get(name)
    for _ in range(count):
        v0 = [Rational(int(e), 100) for e in random.integers(-150, 151, len(scene.v0))]
        friction, e = (Rational(int(random.integers(k, 9)), 10) for k in (1, 0))
        made = Scheme(scene.with_values(v0=v0, friction=friction, restitution=e), midpoint)
        for impacts in ("stepped", "located"):
            found = made.flow(scene.step, impacts=impacts).trajectory(steps)
            laws = defects(made, found, 16)
            assert max(laws.values()) < 1e-11, (v0, friction, e, impacts, laws)


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
    assert ours.keys == theirs.keys
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


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("impacts", ["stepped", "located"])
@pytest.mark.parametrize("rule", ["midpoint", "rectangle"])
def test_what_lands_slides_on_whatever_its_kinetic_energy_is(rule, impacts):
    """Weight 1 and friction κ are constant: μ falls by κh in each step of the slide."""
    quartic = Scene(
        "quartic", pair(2), lambda x, v, p: v.dot(v) / 2 + v.dot(v) ** 2 / 4 - x[1], x0=[0, 1],
        v0=[1, 0], contact=lambda x, p: [x[1]], restitution=0, friction="0.2", impacts=impacts,
    )  # fmt: skip
    found = Scheme(quartic, get(rule)).flow("0.1").trajectory(40)
    slide = found.mu[-8:]
    assert abs(np.diff(slide, axis=0) - [-0.2 * 0.1, 0]).max() < 1e-13 and slide[-1, 0] > 1
    assert abs(slide[:, 1]).max() < 1e-13 and abs(found.gaps[-8:]).max() < 1e-15
    if impacts == "located":  # all of the impact is in the cone
        assert abs(slide[-1, 0] - (2 - 0.2 * 4)) < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("power", [-10, 10])
def test_contact_in_other_units_of_length(power):
    """Of 1e-10 and 1e10 m: an angle stands beside lengths."""
    unit = Rational(10) ** power
    stick = scenes.get("falling-stick").with_values(
        name=f"stick-{power}", x0=[0, Rational(6, 5) * unit, "0.5"],
        v0=[Rational(3, 10) * unit, 0, "0.2"],
        parameters={"mass": 1, "half": unit, "inertia": unit**2 / 3, "gravity": unit},
    )  # fmt: skip
    flow = Scheme(stick, midpoint).flow(stick.step, impacts="located")
    found, plain = flow.trajectory(80), run("falling-stick", stick.step, 80, "located")
    assert len(found.impacts.t) == len(plain.impacts.t) >= 1
    assert abs(found.impacts.t - plain.impacts.t).max() < 1e-11
    assert found.gaps.min() >= -1e-13 * float(unit)


def test_a_rod_on_a_hinge_slides_as_it_closes():
    """With one velocity the slip is a multiple of the gap's rate, and is no mistake."""
    rod = Scene("rod", pair(1), lambda x, v, p: v[0] ** 2 / 6 + sympy.cos(x[0]), x0=["0.2"], v0=[0],
                contact=lambda x, p: [(sympy.cos(x[0]) - Rational(1, 2), [sympy.sin(x[0])])],
                friction="0.1", impacts="located")  # fmt: skip
    assert len(Scheme(rod, midpoint).flow("0.02").trajectory(200).impacts.t) == 0


def test_a_gap_whose_impacts_accumulate_leaves_the_others_their_rebound():
    """Ball 0 has bounced out by t = 1; ball 1 comes at t = 1.2, within the same step.

    A flight of 0.01·0.64ⁿ that is lower than 128 round-offs of its gap is none: from n = 51 on of
    the way that a step could make, h√(2gx₀ + (gh)²), from n = 71 on of the gap's own 0.01.
    """
    two = Scene("two-balls", pair(2), lambda x, v, p: v.dot(v) / 2 - 50 * x[0], x0=["0.01", "1.2"],
                v0=[0, -1], contact=lambda x, p: list(x), restitution="0.8",
                impacts="located")  # fmt: skip
    found = Scheme(two, midpoint).flow("1.5").trajectory(1)
    assert 50 < len(found.impacts.t) <= 71 and found.mu[-1, 0] == 0
    assert abs(found.mu[-1, 1] - 0.8) < 1e-13 and abs(found.x[-1, 1] - 0.24) < 1e-13


@pytest.mark.dear(but=("cayley",))
@pytest.mark.parametrize("retraction", ["cayley", "exponential"])
def test_contact_on_an_action_groupoid(retraction):
    """A spherical pendulum that hits a plate: its attitude stays on the sphere."""
    top = scenes.get("spherical-pendulum").with_retraction(retractions.get(retraction))
    top = top.with_values(contact=lambda x, p: [x[2] + Rational(7, 10)], restitution=1)
    found = Scheme(top, midpoint).flow("0.02", impacts="located").trajectory(100)
    assert len(found.impacts.t) == 2 and found.gaps.min() > -1e-15
    assert abs(np.linalg.norm(found.x, axis=1) - 1).max() < 1e-14
    assert abs(np.linalg.norm(found.impacts.before - found.impacts.after, axis=1)).min() > 0.1


def test_a_slip_whose_friction_would_close_its_gap_has_no_scale():
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
            with pytest.raises(CannotMeasure, match="does not open"):
                scaling(W, on.cones)
    assert sorted(jams) == [False, True]


def test_a_gap_that_is_missed_between_two_steps_is_found():
    """A parabola that dips below the ground inside one step, located."""
    shot = Scene("shot", pair(2), lambda x, v, p: v.dot(v) / 2, x0=[-1, 0], v0=[1, 0],
                 contact=lambda x, p: [x[0] ** 2 - Rational(1, 900) + x[1]],
                 restitution=1, impacts="located")  # fmt: skip
    found = Scheme(shot, midpoint).flow("0.7").trajectory(2)
    assert len(found.impacts.t) == 1 and abs(found.impacts.t[0] - (1 - 1 / 30)) < 1e-10


def test_a_scene_with_contact_is_explained(capsys):
    from discmech.studies.command.entry import main

    assert main(["explain", "sliding-block", "midpoint"]) == 0
    shown = capsys.readouterr().out
    for words in ("0 ≤ x₂", "friction 1/2, restitution 0, impacts located", "of the first 20"):
        assert words in shown
