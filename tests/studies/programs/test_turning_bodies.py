"""Programs that turn a body: their single steps are held against the motion with its attitude."""

import runpy

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from discmech import Scene, black_box, pair, scenes
from discmech.studies import check
from discmech.studies.causes.one_step import of_step
from discmech.studies.causes.unlike_steps import of_unlike_steps
from discmech.studies.core.case import Case, scheme_of
from discmech.studies.evidence import evidence_of
from discmech.studies.evidence.laws import WAY_BACK
from discmech.studies.evidence.many_steps import many_steps
from discmech.studies.evidence.order import NEAR
from discmech.studies.momentum.quantities import measured_in
from discmech.studies.momentum.sight import laws_of
from discmech.studies.symplecticity import along_run
from discmech.studies.symplecticity.places import scale_of
from tests.imports import ROOT

from . import methods

BODY = scenes.get("rigid-body")
PROGRAMS = runpy.run_path(str(ROOT / "docs/attacks/attitudes.py"))


@pytest.mark.dear(but=("matrix",))
@pytest.mark.parametrize("name", ["matrix", "quaternion", "lie_midpoint"])
def test_sound_programs_are_of_order_two(name):
    found = evidence_of(scheme_of(BODY, PROGRAMS[name])).order
    assert not found.unknown and found.order > 2 - NEAR


def test_steps_of_a_body_with_its_attitude_are_compared_with_its_motion():
    case = Case("symplecticity", BODY, PROGRAMS["matrix"], 16, 16)
    assert case.scheme.scene.groupoid.dim_x == 9 and of_unlike_steps(case) is None


@pytest.mark.parametrize(
    ("name", "verdict"),
    [("matrix", "pass"), pytest.param("little", "fail", marks=pytest.mark.slow)],
)
def test_round_off_that_goes_one_way_is_no_loss_of_a_momentum(name, verdict):
    """Sines and cosines round alike; what the method loses in a step sinks with it."""
    found = check("momentum", [BODY], [PROGRAMS[name]], digits=[16], steps=300)
    assert found["verdict"] == verdict


@pytest.mark.dear("quaternion")
@pytest.mark.parametrize("name", ["matrix", "quaternion"])
def test_rows_of_a_run_that_left_the_group_are_no_starts_of_a_way_back(name):
    """A product of many rotations is off by 6e-13, and a step begins at the nearest rotation."""
    assert not WAY_BACK.gaps(many_steps(scheme_of(BODY, PROGRAMS[name]))).max() > 1e-13


@pytest.mark.dear(but=("casimir",))
@pytest.mark.parametrize("name", ["fast", "casimir", "long", "last", "in_space", "first"])
def test_a_body_that_turns_wrongly_is_seen(name):
    found = evidence_of(scheme_of(BODY, PROGRAMS[name])).order
    assert found.order < 2 - NEAR and found.component.startswith("x")


def test_quantities_of_the_attitude_are_held_where_it_is_a_part_of_the_state():
    for program, seen in ((PROGRAMS["matrix"], True), (methods.rk4, False)):
        case = Case("momentum", BODY, program, 16)
        quantities = measured_in(case)
        assert ("spatial angular momentum" in {q.name for q in quantities}) == seen
        laws = {law.name for law in laws_of(quantities)}
        assert ("keeps spatial angular momentum" in laws) == seen and "keeps |μ|²" in laws


@pytest.mark.dear(but=("lossy",))
@pytest.mark.parametrize(
    ("name", "kept"), [("matrix", True), ("lossy", False), ("quaternion", True), ("fast", False)]
)
def test_the_form_along_a_run_is_that_of_the_attitude_and_its_momentum(name, kept, monkeypatch):
    """A small closed curve moves some entries of R by its square, near to their round-off."""
    monkeypatch.setattr(along_run, "MOST", 2**6)
    case = Case("symplecticity", BODY, PROGRAMS[name], 16)
    found = along_run._of_run(case, scale_of(case.scheme), 0)
    assert found.steps == 64 and found.again < 1e-12
    assert (found.broken == 0 and found.seen == 64) is kept


def step(R, w, h, system):
    """A sound step of attitude and velocity in the body, of order 1."""
    inertia = np.array(list(system.parameters.inertia), dtype=float)
    turn = Rotation.from_rotvec(h * w).as_matrix()
    return R @ turn, turn.T @ (inertia * w) / inertia, inertia


def other_side(R, w, h, system):
    return Rotation.from_rotvec(h * w).as_matrix() @ R, step(R, w, h, system)[1]


def transposed(R, w, h, system):
    after, w_after, _ = step(R.T, w, h, system)
    return after.T, w_after


def space(R, w, h, system):
    after, w_after, _ = step(R, R.T @ w, h, system)
    return after, after @ w_after


def from_body_to_space(R, w, h, system):
    after, w_after, _ = step(R, w, h, system)
    return after, after @ w_after


def momenta(R, w, h, system):
    after, w_after, inertia = step(R, system.velocity(R, w), h, system)
    return after, inertia * w_after


def in_space(R, p, h, system):
    return step(R, system.velocity(R, R.T @ p), h, system)[0], p


def twice(R, w, h, system):
    return step(R, 2 * w, h, system)[0], step(R, w, h, system)[1]


def w_last(q, w, h, system):
    after, w_after, _ = step(Rotation.from_quat(q).as_matrix(), w, h, system)
    return Rotation.from_matrix(after).as_quat(), w_after


def conjugate(q, w, h, system):
    after, w_after, _ = step(Rotation.from_quat(q, scalar_first=True).as_matrix(), w, h, system)
    return Rotation.from_matrix(after.T).as_quat(scalar_first=True), w_after


def longer(q, w, h, system):
    """One of Euler's steps of q̇ = q ω / 2, which lengthens q by h² |ω|² / 8."""
    a, b = q[0], q[1:]
    rate = np.concatenate([[-b @ w], a * w + np.cross(b, w)])
    return q + h / 2 * rate, step(np.eye(3), w, h, system)[1]


def stretched(R, w, h, system):
    turned = R + h * np.cross(R, w)
    return turned, step(np.eye(3), w, h, system)[1]


@pytest.mark.parametrize(("cause", "state", "formula"), [
    pytest.param(*one, marks=[pytest.mark.slow] * (k > 1)) for k, one in enumerate([
        ("velocity in space", "Rv", from_body_to_space),
        ("quaternion with w last", "quaternion v", w_last),
        ("velocity from the left", "Rv", other_side),
        ("attitude transposed", "Rv", transposed),
        ("attitude transposed", "quaternion v", conjugate),
        ("velocity in space", "Rv", space),
        ("momentum in space", "Rp", in_space),
        ("momenta for velocities", "Rv", momenta),
        ("factor", "Rv", twice),
    ])
])  # fmt: skip
def test_a_velocity_an_attitude_and_a_momentum_of_the_other_side_are_named(cause, state, formula):
    body = black_box(order=1, state=state)(formula)
    assert of_step(Case("order", BODY, body, 16))["cause"] == cause


def small_turns(R, p, h, system):
    for i, part in ((0, 0.5), (1, 0.5), (2, 1), (1, 0.5), (0, 0.5)):
        v = part * h * p[i] / system.parameters.inertia[i] * np.eye(3)[i]
        short, K = abs(v[i]) < 0.004, np.cross(np.eye(3), -v)
        turn = np.eye(3) + K if short else Rotation.from_rotvec(v).as_matrix()
        R, p = R @ turn, turn.T @ p
    return R, p


@pytest.mark.parametrize(("state", "formula", "said"), [
    ("quaternion v", longer, "not of unit length (by "), ("Rv", stretched, "RᵀR differs from 1"),
    ("Rp", small_turns, "after a step of "),
])  # fmt: skip
def test_an_attitude_that_leaves_the_group_is_not_called_memory(state, formula, said):
    """What a step makes of the nearest attitude differs from the run, but nothing is kept."""
    body = black_box(order=1, state=state)(formula)
    told = of_step(Case("order", BODY, body, 16))
    assert told["cause"] == "no attitude" and said in told["sentence"]


def test_a_momentum_that_is_not_projected_onto_the_hidden_constraint_is_named():
    """It is off by h/2 G^T λ in each row and no later, which is not a half step of another time."""
    shake = black_box(order=2)(methods.unprojected)
    found = of_step(Case("order", scenes.get("cartesian-pendulum"), shake, 16))
    assert found["cause"] == "hidden constraint" and "not projected" in found["sentence"]


#: a bead of mass 1 + x²: momenta and velocities are no multiples of one another
BEAD = Scene("bead", pair(1), lambda x, v, p: (1 + x[0] ** 2) * v[0] ** 2 / 2 - x[0] ** 2 / 2,
             x0=[1], v0=["1/2"], duration=8)  # fmt: skip


@pytest.mark.parametrize(("cause", "share"), [
    ("stale force", 0.5), pytest.param("first order", 0.0, marks=pytest.mark.slow),
])  # fmt: skip
def test_a_program_in_velocities_has_the_causes_of_one_in_momenta(cause, share):
    @black_box(order=2, state="qv")
    def step(q, v, h, system):
        a = -q * (1 + v**2) / (1 + q**2)
        return q + h * v + share * h**2 * np.asarray(a), v + h * a

    assert of_step(Case("order", BEAD, step, 16))["cause"] == cause
