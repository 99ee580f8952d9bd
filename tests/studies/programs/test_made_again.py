"""A program's run is the same steps made again, whichever rows of it a study reads."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from discmech import Scheme, StepFailure, black_box, scenes
from discmech.studies.evidence import Place, evidence_of
from discmech.studies.evidence.late import keeps_something, late_steps
from discmech.studies.evidence.laws import AGAIN
from discmech.studies.evidence.measuring import of_scheme
from discmech.studies.evidence.repeated import repeated

from . import methods
from .judging import judged
from .methods import kick_drift_kick, whole_runs


def departure(box, scene="pendulum"):
    return evidence_of(Scheme(scenes.get(scene), box)).departure(AGAIN)


def of_state(growth, every=7):
    """Return Verlet that changes p in each so many-th of its calls."""
    calls = itertools.count()

    @black_box(order=2)
    def step(q, p, h, s):
        q, p = kick_drift_kick(q, p, h, s)
        return q, p * (1 + growth * (next(calls) % every == 0))

    return step


@black_box(order=2)
def goes_on(q, p, h, s, last={}):  # noqa: B006
    """Verlet that counts the steps which go on from its own last state."""
    count = last["count"] + 1 if last and np.array_equal(last["state"], [*q, *p]) else 1
    q, p = kick_drift_kick(q, p, h, s)
    p = p * (1 + 1e-11 * (count % 4096 == 0))
    last.update(count=count, state=[*q, *p])
    return q, p


@black_box(order=2)
def knows_positions(q, p, h, s, known={}):  # noqa: B006
    """Verlet that gives what it gave from there, whatever the momentum is."""
    return known.setdefault((*q, h), kick_drift_kick(q, p, h, s))


@black_box(order=2)
def writes_to_the_scene(q, p, h, s):
    try:
        s.count += 1
    except AttributeError:
        s.count = 0
    q, p = kick_drift_kick(q, p, h, s)
    return q, p * (1 + 1e-11 * (s.count % 4096 == 0))


@black_box(order=5, runs=True)
def interpolated(q, p, h, steps, every, s):
    """Steps of its own, and rows between them by its interpolation."""

    def f(t, z):
        q, p = np.split(z, 2)
        return np.concatenate([s.velocity(q, p), -np.asarray(s.gradient(q, p))])

    times = h * np.arange(0, steps + 1, every)
    z = solve_ivp(f, (0, times[-1]), np.concatenate([q, p]), t_eval=times, rtol=1e-9, atol=1e-9).y
    return z[: len(q)].T, z[len(q) :].T


@black_box(order=2, runs=True)
def of_positions(q, p, h, steps, every, s):
    """Steps of x alone, which says what μ is."""
    rows = [(q, p)]
    for _ in range(steps):
        q = q + h * s.f(q + h / 2 * s.f(q, p)[0], p)[0]
        rows.append((q, s.momentum(q, q)))
    qs, ps = map(np.array, zip(*rows[::every], strict=True))
    return qs, ps


@black_box(order=2, runs=True, state="Rp")
def of_attitudes(R, p, h, steps, every, s):
    """Whole turns about the axes, in rows of matrices."""
    rows = [(R, p)]
    for _ in range(steps):
        for axis, part in (0, 0.5), (1, 0.5), (2, 1), (1, 0.5), (0, 0.5):
            by = part * h * p[axis] / s.parameters.inertia[axis] * np.eye(3)[axis]
            turn = Rotation.from_rotvec(by).as_matrix()
            R, p = R @ turn, turn.T @ p
        rows.append((R, p))
    Rs, ps = map(np.array, zip(*rows[::every], strict=True))
    return Rs, ps


@pytest.mark.slow
@pytest.mark.parametrize("changed", [
    lambda k, steps: 1.0 if 4 * k % steps == 0 else 1.01,  # right at the rows that order reads
    lambda k, steps: 1.01 if k == steps // 3 else 1.0,  # a single row, which is not smooth
])  # fmt: skip
def test_rows_of_another_run_are_seen(changed):
    assert departure(whole_runs(changed)).broken


@pytest.mark.dear(but=("box2-pendulum", "box0-pendulum"))
@pytest.mark.parametrize("scene", ["pendulum", "kepler"])
@pytest.mark.parametrize("box", [
    methods.verlet, methods.rk4, methods.LateLeapfrog, methods.Beeman,
    whole_runs(lambda k, steps: 1.0), interpolated,
])  # fmt: skip
def test_a_sound_run_is_its_steps(box, scene):
    found = departure(box, scene)
    assert found.size is not None and not found.broken


@pytest.mark.parametrize("known_by", [
    lambda q, p, h, steps: (*q, h, steps), lambda q, p, h, steps: (*q, *p, steps),
])  # fmt: skip
def test_runs_that_are_remembered_by_a_part_of_what_they_depend_on(known_by):
    """Each study would meet a run once: a fault of those that ask for another start or step."""
    runs, of = {}, whole_runs(lambda k, steps: 1.0).formula

    @black_box(order=2, runs=True)
    def remembered(q, p, h, steps, every, s):
        key = known_by(q, p, h, steps)
        if (*key, every) not in runs:
            runs[*key, every] = of(q, p, h, steps, every, s)
        return runs[*key, every]

    found = judged("order", "pendulum", remembered, causes=False)
    assert found["verdict"] == "fail", found["reason"]


@pytest.mark.parametrize("box", [
    of_state(1e-11, 4096), goes_on, knows_positions, writes_to_the_scene,
])  # fmt: skip
def test_a_late_step_is_made_again(box):
    scheme = Scheme(scenes.get("pendulum"), box)
    assert late_steps(scheme).broken
    assert of_scheme(scheme).laws[AGAIN.name].broken


def test_runs_that_count_their_steps_are_told():
    counts = whole_runs(lambda k, steps: 1 + 1e-9 * (k % 4096 == 0))
    assert "something else at their step 4096" in late_steps(
        Scheme(scenes.get("kepler"), counts)).unknown  # fmt: skip
    found = judged("order", "pendulum", counts, causes=False)
    assert found["verdict"] == "inconclusive" and "it counts its steps" in found["reason"]


@pytest.mark.parametrize(("scene", "box"), [
    ("kepler", of_state(0.0)), ("kepler", methods.LateLeapfrog), ("kepler", interpolated),
    ("vortex-pair", of_positions), ("rigid-body", of_attitudes),
])  # fmt: skip
def test_what_counts_nothing_has_its_steps_named(scene, box):
    scheme = Scheme(scenes.get(scene), box)
    again = of_scheme(scheme).laws[AGAIN.name]
    assert not again.broken and not again.unknown and again.asked > 4096
    assert not keeps_something(Scheme(scenes.get("kepler"), methods.verlet))


def test_a_run_that_fails_is_no_pass():
    @black_box(order=2)
    def leaves(q, p, h, s, calls=[]):  # noqa: B006
        calls.append(0)
        if q[0] < -0.5:
            raise ArithmeticError("beyond the table")
        return kick_drift_kick(q, p, h, s)

    scheme = Scheme(scenes.get("pendulum"), leaves)
    flow = scheme.flow(scheme.scene.step)
    start = flow.trajectory(0)
    with pytest.raises(StepFailure, match="beyond the table"):
        repeated(flow, np.concatenate([start.x[0], start.mu[0]]), np.ones(2), 2000)
    local = of_scheme(scheme)
    assert "beyond the table" in local.unscanned
    assert "beyond the table" in local.laws[AGAIN.name].unknown


@pytest.mark.slow
def test_how_far_a_change_grows_is_the_motion_s():
    """A program that enlarges every change buys no larger difference of its own rows."""

    @black_box(order=2, runs=True)
    def wild(q, p, h, steps, every, s):
        rows = [(q, p)]
        for k in range(1, steps + 1):
            q, p = kick_drift_kick(q, p, h, s)
            rows.append((q + 1e-6 * (k < steps) * np.sin(1e9 * rows[0][0]), p))
        qs, ps = map(np.array, zip(*rows[::every], strict=True))
        return qs, ps

    scheme = Scheme(scenes.get("pendulum"), wild)
    place: Place = evidence_of(scheme).places[0]
    z = np.array([float(e) for e in (*place.x, *place.mu)])
    assert repeated(scheme.flow(place.step), z, np.ones(2), 64).gap > 1e-8


@pytest.mark.slow
def test_a_step_that_depends_on_earlier_ones_fails_every_study():
    assert departure(of_state(1e-9)).broken and not departure(of_state(0.0)).broken
    found = judged("order", "pendulum", of_state(1e-12), causes=False)
    assert found["verdict"] == "fail" and "made again, differ from the run by" in found["reason"]
