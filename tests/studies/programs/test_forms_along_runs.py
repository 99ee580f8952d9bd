"""The form along a long run of a program: faults that the first steps do not have."""

from dataclasses import replace

import pytest

from discmech import black_box, scenes
from discmech.studies.core.case import Case
from discmech.studies.symplecticity import along_run
from discmech.studies.symplecticity.places import scale_of

from . import methods
from .judging import judged
from .methods import kick_drift_kick, whole_runs


@black_box(order=2, symplectic=True)
class DampsLater:
    """Verlet that damps from its 200th step on."""

    def start(self, q, p, h, s):
        return q, p, 0

    def step(self, state, h, s):
        q, p = kick_drift_kick(*state[:2], h, s)
        return q, p * (1 - abs(h) ** 3 / 100 if state[2] >= 200 else 1), state[2] + 1

    def read(self, state, s):
        return state[:2]


def of_run(box, scene="pendulum"):
    scene = scenes.get(scene) if isinstance(scene, str) else scene
    case = Case("symplecticity", scene, box, 16)
    return along_run._of_run(case, scale_of(case.scheme), 0)


@pytest.mark.slow
def test_a_form_that_is_lost_after_many_steps_fails():
    found = judged("symplecticity", "pendulum", DampsLater, causes=False)
    assert found["verdict"] == "fail" and "single steps keep the form" in found["reason"]
    assert of_run(DampsLater).broken > 200


@pytest.mark.slow
def test_a_pass_says_how_many_steps_it_has_seen():
    found = judged("symplecticity", "pendulum", methods.verlet, causes=False)
    assert found["verdict"] == "pass"
    steps = found["expected"]["steps"]
    assert steps > 200 and f"runs of up to {steps} steps" in found["reason"]


@pytest.mark.dear("True")
@pytest.mark.parametrize(("damped", "same"), [
    (lambda k, steps: 1.0, True),
    (lambda k, steps: 1.0 if k == steps else 1 - 1e-9, False),  # rows of another motion
])  # fmt: skip
def test_rows_of_a_run_are_the_ends_of_shorter_ones(damped, same, monkeypatch):
    monkeypatch.setattr(along_run, "MOST", 2**7)  # of 2048 it is so, too, and takes long
    assert (of_run(whole_runs(damped)).again < 1e-13) is same


@pytest.mark.slow
@pytest.mark.parametrize(("box", "scene"), [
    (methods.verlet, "kepler"), (methods.LateLeapfrog, "pendulum"), (methods.yoshida, "kepler"),
    (methods.rattle, "cartesian-pendulum"),
])  # fmt: skip
def test_a_sound_run_keeps_the_form(box, scene):
    """Not each row of one run tells: where the motion draws its curve out, a next one does.

    Here one run of kepler's 306 steps is resolved for 224, and one of 1024 of the pendulum for 512.
    """
    found = of_run(box, scene)
    assert not found.broken and found.covered >= found.wanted and found.again < 1e-12


@black_box(order=2)
def damps_beyond(q, p, h, s):
    """Verlet that damps where the pendulum has turned over, which a first run does not reach."""
    q, p = kick_drift_kick(q, p, h, s)
    return q, p * (1 - 1e-6 * (q > 6))


ALMOST_UPRIGHT = replace(scenes.get("pendulum"), x0=[0], v0=["2.00001"], duration=16)


@pytest.mark.parametrize("box", [methods.verlet, damps_beyond])
def test_a_motion_that_draws_curves_out_is_covered_by_runs_after_one_another(box):
    of = of_run(box, ALMOST_UPRIGHT)
    if box is damps_beyond:
        assert of.broken > of.seen
    else:
        assert not of.broken and of.seen < of.wanted <= of.covered


def test_a_run_with_a_memory_is_not_covered_by_others():
    of = of_run(black_box(order=2)(Plain), ALMOST_UPRIGHT)
    assert of.seen == of.covered < of.wanted


class Plain(DampsLater.formula):
    """Verlet that keeps the number of its steps, and makes nothing of it."""

    def step(self, state, h, s):
        return *kick_drift_kick(*state[:2], h, s), state[2] + 1


class DriftsLate(Plain):
    """Verlet whose force is a tenth too large after three fifths of the pendulum's time."""

    def step(self, state, h, s):
        q, p, k = state
        late = 1.1 if k * abs(h) > 6 else 1
        p = p - h / 2 * late * s.gradient(q, p)
        q = q + h * s.velocity(q, p)
        return q, p - h / 2 * late * s.gradient(q, p), k + 1


@pytest.mark.slow
@pytest.mark.parametrize(("formula", "verdict"), [(DriftsLate, "fail"), (Plain, "pass")])
def test_the_order_of_a_program_that_remembers_is_that_of_its_whole_run(formula, verdict):
    """Steps from drawn places begin anew, and so show nothing that comes late."""
    box = black_box(order=2)(formula)
    assert judged("order", "pendulum", box, causes=False)["verdict"] == verdict


@pytest.mark.slow
@pytest.mark.parametrize(("formula", "verdict"), [(DampsLater.formula, "fail"), (Plain, "pass")])
def test_a_program_that_remembers_goes_back_along_a_long_run(formula, verdict):
    box = black_box(order=2, reversible=True)(formula)
    found = judged("reversibility", "pendulum", box, causes=False)
    assert found["verdict"] == verdict
    assert verdict == "pass" or "256 steps back miss the start" in found["reason"]
