"""Faults of programs in parts of the states that the scene's motion does not visit."""

from dataclasses import replace

import numpy as np
import pytest
import sympy

from discmech import Scene, Scheme, black_box, compose, one_step, pair, scenes
from discmech.studies.evidence import evidence_of

from . import methods
from .judging import judged
from .test_gradients import tangent
from .test_maps_of_one_step import in_a_box


def damped(part, loss):
    """Return Verlet that damps by loss(h) where the states, over those of the motion, say so."""

    @black_box(order=2, symplectic=True, reversible=True, vectorised=True)
    def step(q, p, h, s):
        there = part(q / 2, p / 2)
        q, p = methods.kick_drift_kick(q, p, h, s)
        return q, p * (1 - loss(h) * there)

    return step


PARTS = {
    "outside": lambda q, p: abs(q) > 1.2, "fast": lambda q, p: abs(p) > 1.2,
    "corner": lambda q, p: (q > 0.8) & (p > 0.8), "nowhere": lambda q, p: 0,
}  # fmt: skip


@pytest.mark.sampled
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("rate", [1e-3, -1e-3])
def test_a_program_is_asked_beside_the_motion(part, rate):
    """A program that damps, or heats, in a part of the states alone is not consistent there."""
    scheme = Scheme(scenes.get("pendulum"), damped(PARTS[part], lambda h: rate * h))
    evidence = evidence_of(scheme)
    assert evidence.order.order == pytest.approx(2 if part == "nowhere" else 0, abs=0.05)
    assert evidence.around[0] == 1024 and (len(evidence.places) > 4) == (part != "nowhere")


@pytest.mark.parametrize("size", [0, sympy.Rational(1, 1000)])
def test_so_is_a_composition_of_one_step_maps(size):
    """Its force is too large in a narrow part."""

    def kick(s, z, h):
        x, p = s.split(z)
        part = sympy.exp(-1600 * (x[0] - sympy.Rational(47, 20)) ** 2)
        return x, p + h / 2 * s.split(s.f(z))[1] * (1 + size * part)

    @one_step(order=2)
    def verlet(s, z, h):
        x, p = kick(s, z, h)
        x = x + h * s.split(s.f(s.join(x, p)))[0]
        return s.join(*kick(s, s.join(x, p), h))

    evidence = evidence_of(Scheme(scenes.get("pendulum"), compose(verlet, "suzuki")))
    assert evidence.around[0] == 256 and evidence.order.order == pytest.approx(
        0 if size else 4, abs=0.01
    )


@pytest.mark.dear("[0]")
@pytest.mark.parametrize("rate", [0, 1e-3])
def test_states_outside_the_domain_hide_no_fault_at_others(rate):
    """Of 1024 states drawn beside this motion some 170 would be faster than 1."""
    bounded = Scene(
        "bounded", pair(1), lambda x, v, p: -sympy.sqrt(1 - v[0] ** 2) - x[0] ** 2 / 2,
        x0=[0], v0=["0.9"], duration=10, step="1/20",
    )  # fmt: skip
    evidence = evidence_of(Scheme(bounded, damped(PARTS["outside"], lambda h: rate * h)))
    assert evidence.order.order == pytest.approx(0 if rate else 2, abs=0.05)
    assert 700 < evidence.around[0] < 1000 and len(evidence.places) > 4 * bool(rate)


@pytest.mark.slow
def test_an_energy_that_is_lost_beside_the_motion_by_a_power_of_the_order():
    lossy = damped(PARTS["outside"], lambda h: 1e-2 * h**3)
    verdict = judged("energy", "pendulum", lossy, causes=False)
    assert verdict["verdict"] == "fail" and "beside the motion" in verdict["reason"]
    verdict = judged("energy", "pendulum", methods.verlet, causes=False)
    assert verdict["verdict"] == "pass" and "1024 drawn states, up to 0.5" in verdict["reason"]


@pytest.mark.dear("[0]")
@pytest.mark.parametrize("side", [0, 0.03])
def test_a_corner_of_a_box_of_states(side):
    def turn(q, p):
        kept = 1 - 1e-6 * (np.minimum(q, p) > 0.3 - 0.6 * side)
        p = p - q**2
        return np.cos(1) * q + np.sin(1) * p, kept * (np.cos(1) * p - np.sin(1) * q)

    box = in_a_box(turn, [-0.3, -0.3], [0.3, 0.3])
    verdict = judged("symplecticity", box.own_scene, box, causes=False)
    assert verdict["verdict"] == ("fail" if side else "pass")


def test_a_form_that_is_lost_in_a_corner_with_no_volume():
    def turn(q, p):
        p = p - q**2
        kept = 1 - 1e-6 * (np.minimum(q[0], p[0]) > 0.22)
        q, p = np.cos(1) * q + np.sin(1) * p, np.cos(1) * p - np.sin(1) * q
        return q, np.array([p[0] * kept, p[1] / kept])

    box = in_a_box(turn, [-0.3] * 4, [0.3] * 4)
    verdict = judged("symplecticity", box.own_scene, box, causes=False)
    assert verdict["verdict"] == "fail" and "volume" not in verdict["reason"]


@pytest.mark.parametrize("off", [0, 1e-6])
def test_a_jacobian_that_is_wrong_in_a_sector(off):
    def jacobian(q, p, h, s):
        matrix = tangent(q, p, h, 1, s)[0]["start"]
        return matrix + off * (q[0] < -1 and p[0] > 0) * np.array([[0, 0], [1, 0]])

    box = replace(methods.verlet, jacobian=jacobian, vectorised=True)
    verdict = judged("symplecticity", "pendulum", box, causes=False)
    assert verdict["verdict"] == ("fail" if off else "pass")
    assert ("its jacobian is not the derivative" in verdict["reason"]) == bool(off)


@pytest.mark.dear("0.0695", "0.0017")
@pytest.mark.parametrize(("low", "high"), [(0.0695, 0.0705), (0.011, 0.019), (0.0017, 0.0019)])
def test_a_form_that_is_lost_in_a_band_of_sizes_of_steps(low, high):
    @black_box(order=2, symplectic=True, vectorised=True)
    def narrow(q, p, h, s):
        q, p = methods.kick_drift_kick(q, p, h, s)
        return q, p * (1 - 1e-7 * (low < h < high))

    assert judged("symplecticity", "pendulum", narrow, causes=False)["verdict"] == "fail"
