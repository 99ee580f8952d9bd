"""Contact: motions in closed form, and the orders of rules under it."""

import mpmath
import numpy as np
import pytest

from discmech import Scene, Scheme, midpoint, pair, trapezoidal
from discmech.integrators.rules import get
from tests.integrators.extensions.contact.motions import BALL, BLOCK, SPRING, run, scheme


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
    found = run("sliding-block", "0.07", 86, impacts, midpoint, digits)  # it stops inside a step
    wanted = mpmath.mpf("2.5")
    assert abs(found.x[-1, 0] - wanted) < (10 ** (3.5 - digits) if impacts == "located" else 3e-3)
    assert abs(found.mu[-1]).max() == 0 and abs(found.x[-1] - found.x[-3]).max() == 0
    assert abs(found.multipliers[:-1, 0] - mpmath.mpf("0.96")).max() < 1e-13
    sliding, resting = found.impulses[2, 0], found.impulses[-2, 0]
    assert abs(sliding[1] / sliding[0] + 0.5) < 1e-13  # Coulomb's cone, against the slip
    assert abs(resting[1] + mpmath.mpf("0.0196")) < 1e-13  # what holds it on the slope


def test_a_block_on_a_steep_slope_slides_on():
    found = Scheme(BLOCK.with_values(friction="0.1"), trapezoidal).flow("0.1").trajectory(40)
    rate = 0.28 - 0.1 * 0.96
    assert abs(found.x[-1, 0] - (4 + rate * 8)) < 1e-12


@pytest.mark.parametrize(
    ("rule", "order"), [("midpoint", 2), ("gauss-2", 4), ("implicit-midpoint", 2)]
)
def test_located_impacts_have_the_order_of_the_rule(rule, order):
    made = Scheme(SPRING, get(rule))
    wanted = (np.pi - np.arccos(0.5)) * np.array([1, 3])
    off = [abs(made.flow(h).trajectory(n).impacts.t - wanted).max()
           for h, n in (("0.2", 33), ("0.1", 66))]  # fmt: skip
    assert abs(np.log2(off[0] / off[1]) - order) < 0.2


@pytest.mark.slow
def test_stepped_impacts_have_order_one():
    """Late by 0 to 1 steps, and by half of one on average over starts: of no higher order.

    The mean of 24 that fall anywhere has the deviation 1/√(12·24); a quarter is four below a half.
    """
    made, starts = Scheme(SPRING, midpoint), 1 + 0.02 * np.sqrt(2) * np.arange(24)
    for step in (0.02, 0.005):
        flow = made.flow(step, impacts="stepped")
        late = [flow.trajectory(round(2.4 / step), x0=[x], mu0=[0]).impacts.t[0] / step
                - (np.pi - np.arccos(0.5 / x)) / step for x in starts]  # fmt: skip
        assert min(late) > -0.01 and max(late) < 1.01 and np.mean(late) > 0.25


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


@pytest.mark.slow
def test_a_hundred_thousand_impacts_lose_no_energy():
    start = "0.0213"  # from 0.02 each flight is four steps
    found = Scheme(BALL.with_values(x0=[start]), midpoint).flow("0.1").trajectory(430_000, 997)
    assert len(found.impacts.t) >= 100_000
    energy = found.mu[:, 0] ** 2 / 2 + found.x[:, 0]
    assert abs(energy / float(start) - 1).max() < 1e-10
