"""Programs whose state has a body's attitude: a matrix or a quaternion, momenta or velocities."""

import copy
import runpy

import mpmath
import numpy as np
import pytest

from discmech import BadInput, Scheme, black_box, scenes
from discmech.integrators.errors import CannotMeasure
from discmech.integrators.extensions.foreign.states import STATES
from tests.imports import ROOT

BODY = scenes.get("rigid-body")
PROGRAMS = runpy.run_path(str(ROOT / "docs/attacks/attitudes.py"))
QUATERNION = STATES["quaternion p"]
#: roundings of an entry by a quaternion's products, there and back
ROUNDINGS = 16 * 2.0**-53


def rotations(count):
    q = np.random.default_rng(1).standard_normal((4, count))
    q[:, 0], q[0, 1], q[0, 2] = [1, 0, 0, 0], 0, 1e-9  # none, and half turns
    return QUATERNION.read(q / np.sqrt((q * q).sum(axis=0)))


@pytest.mark.parametrize("name", STATES)
def test_a_state_is_read_as_it_was_written(name):
    state, x = STATES[name], rotations(200)
    assert abs(state.read(state.written(x)) - x).max() < ROUNDINGS
    one = state.written(x[:, 3])
    assert abs(state.written(x)[..., 3] - one).max() < ROUNDINGS


@pytest.mark.parametrize("name", ["Rp", "quaternion p"])
def test_beside_the_group_the_nearest_rotation_is_smooth(name):
    state, x = STATES[name], rotations(20)
    way = np.random.default_rng(2).standard_normal(x.shape)
    ends = [state.read(state.written(x + w * way)) for w in (2e-4, -2e-4, 1e-4, -1e-4)]
    slopes = (ends[0] - ends[1]) / 4e-4, (ends[2] - ends[3]) / 2e-4
    assert abs(slopes[0] - slopes[1]).max() < 1e-5
    A = ends[0].T.reshape(-1, 3, 3)
    assert abs(A @ A.transpose(0, 2, 1) - np.eye(3)).max() < ROUNDINGS


def test_what_is_no_number_stays_none():
    for name in ("Rp", "quaternion p"):
        assert np.isnan(STATES[name].written(np.full(9, np.nan))).all()


def test_more_digits_stay():
    with mpmath.workdps(50):
        a, b = mpmath.mpf(3) / 5, mpmath.mpf(4) / 5
        x = np.array([a, -b, 0, b, a, 0, 0, 0, 1], dtype=object) * mpmath.mpf(1)
        assert max(abs(QUATERNION.read(QUATERNION.written(x)) - x)) < mpmath.mpf(10) ** -48


def test_a_quaternion_that_loses_its_length_is_no_rotation():
    assert np.array_equal(QUATERNION.read(np.array([2.0, 0, 0, 0])), 4 * np.eye(3).ravel())


def test_the_attitude_turns_with_the_body():
    rows = []
    for name in ("matrix", "quaternion"):
        run = Scheme(BODY, PROGRAMS[name]).flow("1/10").trajectory(20)
        assert run.x.shape == (21, 9)
        rows.append(np.hstack([run.x, run.mu]))
        spatial = [x.reshape(3, 3) @ mu for x, mu in zip(run.x, run.mu, strict=True)]
        assert abs(np.array(spatial) - spatial[0]).max() < 1e-13
    assert abs(rows[0] - rows[1]).max() < 1e-13
    whole = Scheme(BODY.with_attitude(), PROGRAMS["matrix"]).flow("1/10").trajectory(20)
    assert np.array_equal(np.hstack([whole.x, whole.mu]), rows[0])


def test_the_scene_in_numbers_takes_the_programs_own_attitude():
    asked = []

    @black_box(state="quaternion v")
    def still(q, v, h, system):
        asked.append((system.H(q, system.momentum(q, v)), system.n, system.parameters.inertia[2]))
        return q, v

    run = Scheme(BODY, still).flow("1/10").trajectory(1)
    assert asked[0][0] == pytest.approx(run.mu[0] @ run.u[0] / 2)
    assert asked[0][1:] == (9, 3)


def test_a_scene_with_its_attitude_is_its_own():
    whole = BODY.with_attitude()
    assert whole.with_attitude() is whole


@pytest.mark.parametrize("name", ["pendulum", "rigid-body-so4", "heavy-top"])
def test_other_scenes_have_no_such_state(name):
    with pytest.raises(CannotMeasure, match=r"no attitude.*lie_group\(so\(3\)\)"):
        Scheme(scenes.get(name), PROGRAMS["matrix"])


def test_bad_states_are_refused():
    with pytest.raises(BadInput, match="state is 'qp' or 'qv' or 'Rp' or 'Rv' or 'quaternion p'"):
        black_box(state="wxyz")
    with pytest.raises(BadInput, match=r"jacobian=.*leave it out"):
        black_box(state="Rp", jacobian=lambda q, p, h, system: None)


def test_functions_of_the_scene_may_be_copied():
    seen = []

    @black_box(order=2, state="Rp", name="copies")
    def step(R, p, h, system):
        seen.append(copy.deepcopy(system).velocity(R, p) - system.velocity(R, p))
        return R, p

    Scheme(scenes.get("rigid-body"), step).flow("0.1").trajectory(1)
    assert seen and not np.any(seen)
