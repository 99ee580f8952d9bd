"""Programs that are no map, change what they are given, raise, or hide a small fault."""

import dataclasses
import math
import random
import sys

import numpy as np
import pytest

from discmech import BadInput, Conserved, Scene, Scheme, StepFailure, black_box, pair, scenes
from discmech.integrators import rules
from discmech.studies.core.claims import claiming
from discmech.studies.evidence.laws import ENERGY, worst_departure
from discmech.studies.symplecticity import along_run

from . import methods
from .judging import judged
from .methods import kick_drift_kick


@pytest.mark.slow
def test_a_method_that_keeps_no_form_is_a_map_in_its_runs_too():
    last = {"length": 0, "end": ()}

    @black_box(order=4, symplectic=False)
    def other_in_runs(q, p, h, s):
        last["length"] = last["length"] + 1 if last["end"] == (*q, *p) else 0
        q, p = methods.rk4.formula(q, p, h, s)
        p = p * (1 - abs(h) ** 5 / 10 * (last["length"] > 6))
        last["end"] = (*q, *p)
        return q, p

    found = judged("symplecticity", "pendulum", other_in_runs, causes=False)
    assert found["verdict"] == "fail" and "between calls" in found["reason"]
    found = judged("symplecticity", "pendulum", methods.rk4, causes=False)
    assert found["verdict"] == "measured"


@pytest.mark.slow
def test_a_run_that_ends_beside_its_row_is_told_in_words_for_runs(monkeypatch):
    monkeypatch.setattr(along_run, "MOST", 2**7)  # of 2048 it is seen, too, and takes long

    between = methods.whole_runs(lambda k, steps: 1.0 if k == steps else 1 - 1e-9)
    found = judged("symplecticity", "pendulum", between, causes=False)
    assert found["verdict"] == "fail" and "rows are interpolated" in found["reason"]


@pytest.mark.slow
def test_volume_is_judged_where_no_form_is_claimed():
    claimed = dataclasses.replace(methods.rk4, claims=rules.Claims(keeps=("volume",)))
    found = judged("symplecticity", "pendulum", claimed, causes=False)
    assert found["verdict"] == "fail" and "volume is not kept" in found["reason"]
    claimed = dataclasses.replace(methods.verlet, claims=claimed.claims)
    found = judged("symplecticity", "pendulum", claimed, causes=False)
    assert found["verdict"] == "pass" and "does not claim" in found["expected"]["not_demanded"]


@pytest.mark.slow
def test_a_sound_method_without_a_verdict_has_no_cause():
    single = dataclasses.replace(methods.rk4, numbers="float32")
    found = judged("order", "pendulum", single)
    assert found["verdict"] == "inconclusive" and "diagnosis" not in found
    assert "--digits" not in found["reason"]


@pytest.mark.slow
def test_a_step_that_looks_at_h_is_seen_at_others():
    @black_box(order=2)
    def looking(q, p, h, s):
        ladder = [10 / 4 / round(2.5 / h) - h == 0, abs(np.log2(h / 0.1) * 2 % 1) < 0.2]
        return kick_drift_kick(q, p, h if any(ladder) else h * (1 + 1e-3), s)

    found = judged("order", "pendulum", looking, causes=False)
    assert found["verdict"] == "fail"


def test_views_and_buffers_are_copied():
    kept = np.zeros(1), np.zeros(1)

    @black_box(order=2)
    def buffered(q, p, h, s):
        kept[0][:], kept[1][:] = kick_drift_kick(q, p, h, s)
        return kept[0][:], kept[1][:]

    run = Scheme(scenes.get("pendulum"), buffered).flow("0.1").trajectory(5)
    same = Scheme(scenes.get("pendulum"), methods.verlet).flow("0.1").trajectory(5)
    assert np.array_equal(run.x, same.x)


def test_a_step_that_raises_is_a_failure_with_the_rows_so_far():
    @black_box(order=2)
    def raising(q, p, h, s):
        if q[0] < 0.5:
            raise RuntimeError("no table there")
        return kick_drift_kick(q, p, h, s)

    flow = Scheme(scenes.get("pendulum"), raising).flow("0.1")
    with pytest.raises(StepFailure, match="RuntimeError: no table there") as caught:
        flow.trajectory(200)
    assert len(caught.value.trajectory.t) == caught.value.step_index + 1 > 3
    ends = black_box(name="ends")(lambda q, p, h, s: sys.exit(3))
    with pytest.raises(StepFailure, match="SystemExit: 3"):
        Scheme(scenes.get("pendulum"), ends).flow("0.1").trajectory(1)


@pytest.mark.parametrize(("study", "symplectic"), [
    ("order", False), ("symplecticity", True), ("momentum", False), ("energy", False),
    ("stability", False), ("stability", True),
])  # fmt: skip
def test_a_step_that_always_raises_fails_in_every_study(study, symplectic):
    @black_box(order=2, symplectic=symplectic)
    def unlicensed(q, p, h, s):
        raise ValueError("no licence")

    found = judged(study, "kepler", unlicensed)
    assert found["verdict"] == "fail" and "raises ValueError: no licence" in found["reason"]
    assert "please report" not in str(found.get("diagnosis"))


def test_a_way_back_may_change_what_it_is_given():
    def read(q, p):
        p *= 0.5
        return q, p

    doubled = black_box(write=lambda x, mu: (x, 2 * mu), read=read, name="doubled")(
        lambda q, p, h, s: (q, p)
    )
    run = Scheme(scenes.get("kepler"), doubled).flow("0.1").trajectory(3)
    assert np.array_equal(run.mu[0], run.mu[-1])


@pytest.mark.parametrize(("step", "said"), [
    (lambda q, p, h, s: [q[0], p[0], 1], "3 things"),
    (lambda q, p, h, s: None, "nothing"),
    (lambda q, p, h, s: ([0.0], p), "a list"),
    (lambda q, p, h, s: (np.zeros(2), p), r"shape \(2,\)"),
    (lambda q, p, h, s: (q + 0j, p), "complex"),
    (lambda q, p, h, s: (s.gradient(q), p), r"raises TypeError: .* take \(q, p\)"),
    (lambda q, p, h, s: (q, p - math.sin(np.ones(2))), r"np\.sin in place of math"),
    (lambda q, p, h, s: (q + unknown, p), "raises NameError"),  # noqa: F821
    (lambda q, p, h, s: __import__("beside"), r"No module.*: import it at the top of its file"),
])  # fmt: skip
def test_an_answer_of_another_kind_is_one_sentence(step, said):
    box = black_box(name="odd")(step)
    with pytest.raises(BadInput, match=said):
        Scheme(scenes.get("pendulum"), box).flow("0.1").trajectory(1)


def test_other_bad_input_is_one_sentence():
    @black_box()
    def in_place(q, p, h, s):
        q += h * p
        return q, p

    @black_box()
    def not_a_number(q, p, h, s):
        return q * np.nan, p

    with pytest.raises(BadInput, match="changes its argument in place"):
        Scheme(scenes.get("pendulum"), in_place).flow("0.1").trajectory(1)

    @black_box(runs=True, name="one-array")
    def one_array(q, p, h, steps, every):
        qs, ps = [q.copy()], [p.copy()]
        for _ in range(steps // every):
            q += h
            qs, ps = [*qs, q], [*ps, p]
        return np.array(qs), np.array(ps)

    with pytest.raises(BadInput, match="rows that are all the same, as those of one array"):
        Scheme(scenes.get("harmonic"), one_array).flow("0.1").trajectory(3)
    with pytest.raises(StepFailure, match="not finite"):
        Scheme(scenes.get("pendulum"), not_a_number).flow("0.1").trajectory(1)
    with pytest.raises(BadInput, match="takes 2 arguments"):
        black_box(name="short")(lambda q, p: (q, p))
    with pytest.raises(BadInput, match="takes system by name alone"):
        black_box()(lambda q, p, h, *, system: (q, p))
    with pytest.raises(BadInput, match="no step"):
        black_box()(type("Method", (), {"start": lambda self, q, p, h: 0}))
    with pytest.raises(BadInput, match="with brackets"):
        black_box(kick_drift_kick)
    with pytest.raises(BadInput, match="compose its steps in it"):
        rules.compose(methods.verlet, "triple-jump")
    with pytest.raises(BadInput, match="machine numbers"):
        Scheme(scenes.get("pendulum"), methods.verlet).flow("0.1", digits=50)


def needs_a_buffer(change):
    """A step by compiled code that refuses arrays which it could not write to."""

    @black_box(order=2)
    def step(q, p, h, system):
        if not (q.flags.writeable and p.flags.writeable):
            raise ValueError("buffer source array is read-only")
        p = p - h / 2 * system.gradient(q, p)
        after = q + h * system.velocity(q, p)
        q += change
        return after, p - h / 2 * system.gradient(after, p)

    return step


def test_compiled_code_that_only_reads_its_arguments_may_have_them_as_copies():
    assert judged("order", "pendulum", needs_a_buffer(0), causes=False)["verdict"] == "pass"
    with pytest.raises(BadInput, match="changes its argument in place"):
        Scheme(scenes.get("pendulum"), needs_a_buffer(1e-9)).flow("0.1").trajectory(1)


@pytest.mark.slow
def test_a_momentum_that_is_kept_in_one_plane_alone_is_not_kept():
    import sympy

    planar = Scene(
        name="planar-kepler", groupoid=pair(3),
        lagrangian=lambda x, v, p: v.dot(v) / 2 + 1 / sympy.sqrt(x.dot(x)),
        x0=["0.4", 0, 0], v0=[0, 2, 0], duration=10, step="0.01",
        symmetries=[Conserved("angular momentum", lambda x, mu, p: x.cross(mu))],
    )  # fmt: skip

    @black_box(order=2, keeps=["momentum"])
    def off_plane(q, p, h, s):
        q, p = kick_drift_kick(q, p, h, s)
        return q, p - [0, 0, abs(h) ** 3 * (p[2] + q[2] ** 2)]

    found = judged("momentum", planar, off_plane, steps=200, causes=False)
    assert found["verdict"] == "fail" and "but a step of" in found["reason"]
    assert "a step of 0 " not in found["reason"]
    sound = dataclasses.replace(methods.verlet, claims=off_plane.claims)
    assert judged("momentum", planar, sound, steps=200, causes=False)["verdict"] == "pass"


def projected(q, p, s, energy):
    for _ in range(4):
        slope = np.array([*s.gradient(q, p), *s.velocity(q, p)])
        off = (s.H(q, p) - energy) / (slope @ slope)
        q, p = q - off * slope[: s.n], p - off * slope[s.n :]
    return q, p


def of_its_start(q, p, h, s):
    return projected(*kick_drift_kick(q, p, h, s), s, s.H(np.array([2.0]), np.array([0.0])))


def of_each_state(q, p, h, s):
    return projected(*kick_drift_kick(q, p, h, s), s, s.H(q, p))


@pytest.mark.dear("pass", "of_its_start")
@pytest.mark.parametrize(
    ("step", "claim", "verdict"),
    [(of_its_start, "energy", "fail"), (kick_drift_kick, "energy", "fail"),
     (of_each_state, "energy", "pass"), (kick_drift_kick, "energy band", "pass")],
)  # fmt: skip
def test_a_claimed_energy_is_kept_from_every_state(step, claim, verdict):
    box = black_box(order=2, keeps=claim)(step)
    found = judged("energy", scenes.get("pendulum"), box, steps=500, causes=False)
    assert found["verdict"] == verdict
    assert verdict == "pass" or "changes the energy by" in found["reason"]


@pytest.mark.dear(but=("lambda>0",))
@pytest.mark.parametrize("wrong", [
    lambda q, h: abs(h) > 0.07, lambda q, h: abs(h) < 0.002, lambda q, h: h < 0,
    lambda q, h: q[0] > 2, lambda q, h: abs(q[0] - 0.33) < 0.002,
])  # fmt: skip
def test_a_claimed_energy_is_kept_at_every_step_and_in_every_part_of_the_motion(wrong):
    """Eight places, and steps of 0.03 to 0.07, passed each of these."""

    @black_box(order=2, keeps="energy")
    def seldom(q, p, h, s):
        after = kick_drift_kick(q, p, h, s)
        return after if wrong(q, h) else projected(*after, s, s.H(q, p))

    scheme = Scheme(scenes.get("pendulum"), seldom)
    assert worst_departure(ENERGY[True], scheme, [], random.Random(0)).broken


@pytest.mark.slow
@pytest.mark.parametrize(("digits", "verdict"), [(16, "pass"), (50, "fail")])
def test_an_energy_that_a_quadrature_keeps_is_kept_in_doubles(digits, verdict):
    """Of six nodes, on a force that is no polynomial: exact to round-off, and not to 40 digits."""
    mean = rules.get("average-vector-field")
    claimed = dataclasses.replace(mean, claims=rules.Claims(keeps=("energy",)))
    found = judged("energy", scenes.get("kepler"), claimed, 200, False, digits)
    assert found["verdict"] == verdict
    assert verdict == "pass" or "changes the energy by" in found["reason"]


@pytest.mark.slow
def test_a_small_defect_is_not_passed_for_none():
    """Of RK4 at steps so small that differences hardly see its defect."""
    tiny = scenes.get("pendulum").with_values(step="0.0005", duration="0.1")
    found = judged("symplecticity", tiny, claiming(methods.rk4, "symplecticity"), causes=False)
    assert found["verdict"] == "fail" or "hidden" in found["reason"]
