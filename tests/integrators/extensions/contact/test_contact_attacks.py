"""Motions under contact that are known in closed form, at the step sizes that once went wrong."""

import os
import runpy
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from discmech import Scheme, StepFailure, midpoint
from tests.imports import ROOT

attacks = SimpleNamespace(**runpy.run_path(str(ROOT / "docs/attacks/contact.py")))
MODES = ("stepped", "located")


def run(scene, step, steps, impacts="located"):
    return Scheme(scene, midpoint).flow(step, impacts=impacts).trajectory(steps)


def slope_misses(scheme, inertia, impacts, step):
    """How far rolling down a 3:4 slope is from x = g sin α t²/(2 (1 + J)) (Landau, Lifshitz)."""
    found = scheme.flow(step, impacts=impacts).trajectory(int(2 / step))
    return abs(found.x[:, 0] - 0.3 / (1 + float(inertia)) * found.t**2).max()


def slip_misses(scheme, share, step):
    """How far a throw at 1 with κ = 0.2 on the flat is from sliding, and then `share` of 1."""
    ends = (1 - share) / 0.2
    found = scheme.flow(step).trajectory(int(1.2 * ends / step) + 2)
    t = np.minimum(found.t, ends)
    return abs(found.x[:, 0] - (t - 0.1 * t**2 + share * (found.t - t))).max()


def jam_misses(scheme, impacts, step):
    """How far the impulse of Painlevé's rod, which sticks at once, is from (0.3, 0.4)."""
    first = scheme.flow(step, impacts=impacts).trajectory(2).impulses[0, 0]
    return abs(first - [0.3, 0.4]).max()


def thrown(inertia):
    return attacks.rolling(inertia, "0.2", slope=(0, 1), v0=[1, 0, 0], impacts="located")


@pytest.mark.parametrize("impacts", MODES)
def test_a_slip_that_jams_sticks_at_once(impacts):
    """Stewart and Trinkle's problem of one step has this one solution, W⁻¹(0, 1) but for O(h)."""
    rod = Scheme(attacks.rod(2), midpoint)
    for step in (1e-2, 1e-5):
        assert jam_misses(rod, impacts, step) < step
    sliding = run(attacks.rod("1.2"), 1e-4, 2, impacts).impulses[0, 0, 0]
    assert abs(sliding / 1e-4 - 6.25) < 2e-3  # g/(1.6 − 1.2 κ)


@pytest.mark.slow
def test_a_puck_slides_along_its_line_and_stops_where_its_energy_is_spent():
    puck = attacks.puck
    assert abs(run(puck, "0.01", 500).x[-1] - [1, 4 / 3, 0]).max() < 1e-12  # v²/2κ = 5/3


@pytest.mark.parametrize(("speed", "restitution"), [("3", "1/2"), ("1/4", "1/2"), ("3", 0)])
def test_a_spinning_disc_meets_the_floor_as_coulomb_says(speed, restitution):
    """It lands obliquely and slips by κP, or sticks by a third of the slip (Keller 1986)."""
    disc = attacks.rolling(
        Fraction(1, 2), "1/5", slope=(0, 0), x0=[0, 1, 0], v0=[speed, -1, "1/2"],
        restitution=restitution, impacts="located",
    )  # fmt: skip
    bounce, v = 1 + float(Fraction(restitution)), float(Fraction(speed))
    along = -bounce * min(0.2, (v + 0.5) / 3)
    found = run(disc, "0.1", 15).mu[-1]
    assert abs(found - [v + along, -1 + bounce, 0.25 + along]).max() < 1e-13


@pytest.mark.slow
def test_rolling_slipping_and_jamming_at_random_steps():
    """500 steps drawn over four scenes, none refused and none off; DISCMECH_SEED: others."""
    random = np.random.default_rng(int(os.environ.get("DISCMECH_SEED", "20261126")))
    kinds = [
        *((Scheme(attacks.rolling(J), midpoint), lambda s, h, J=J: slope_misses(
            s, J, MODES[int(h * 1e9) % 2], h), 1e-12) for J in (Fraction(1, 2), Fraction(2, 5))),
        (Scheme(thrown(Fraction(2, 5)), midpoint), lambda s, h: slip_misses(s, 5 / 7, h), 1e-10),
        (Scheme(attacks.rod(2), midpoint), lambda s, h: jam_misses(
            s, MODES[int(h * 1e9) % 2], h) / h, 1),
    ]  # fmt: skip
    wrong = []
    for k in range(500):
        scheme, misses, allowed = kinds[k % 4]
        step = float(random.uniform(0.005, 0.05))
        try:
            off = misses(scheme, step)
        except StepFailure as failure:
            off = str(failure)
        if not (isinstance(off, float) and off < allowed):
            wrong.append((k % 4, step, off))
    assert not wrong, wrong


@pytest.mark.slow
def test_a_block_stops_whatever_the_scale_of_its_gap():
    found = run(attacks.blown, "0.01", 300)
    assert abs(found.x[-1] - [1, 0]).max() < 1e-12


@pytest.mark.parametrize("impacts", MODES)
@pytest.mark.parametrize("name", ["post", "wall", "spike"])
def test_what_is_thinner_than_a_step_is_hit(name, impacts):
    found = run(getattr(attacks, name), "0.03", 60, impacts)
    assert len(found.impacts.t) == 1
    assert abs(found.impacts.t[0] - 1) < 2e-3 and found.mu[-1, 0] < 0


@pytest.mark.parametrize("impacts", MODES)
def test_a_step_may_end_where_a_distance_has_no_slope(impacts):
    """At the centre of a post, which is hit, and at that of a ring, which is passed."""
    for digits, step in ((16, "0.25"), (16, "0.02"), (30, "0.25")):
        flow = Scheme(attacks.post, midpoint).flow(step, digits, impacts=impacts)
        found = flow.trajectory(round(1.5 / float(step)))
        assert len(found.impacts.t) == 1 and abs(found.impacts.t[0] - 1) < 2e-3
        assert abs(found.mu[-1, 0] + 1) < 1e-12
    ring = run(attacks.ring, "0.25", 12, impacts)
    assert abs(ring.x[-1] - [1, 0]).max() < 1e-12 and ring.impacts.t == pytest.approx([2])


def test_a_thin_peg_is_hit_at_any_step():
    for impacts, step in (("stepped", "0.0025"), ("located", "0.02")):
        found = run(attacks.pegs, step, round(1 / float(step)), impacts)
        assert found.impacts.impulses[0, 1, 0] > 0 and abs(found.impacts.t[0] - 0.705) < 3e-3


def test_what_comes_to_rest_at_the_end_of_a_step_rests():
    found = run(attacks.hang_ball, "0.02", 200)
    assert len(found.impacts.t) < 40 and abs(found.x[-1] - [2.92, 0]).max() < 1e-9
