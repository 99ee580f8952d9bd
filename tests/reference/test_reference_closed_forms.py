"""Closed forms against the Taylor integrator, which knows none of them."""

from dataclasses import replace
from fractions import Fraction

import pytest
import sympy

from integrators import scenes
from reference import solution
from reference.agreement import agreement
from reference.certify import certified_integration

PENDULUM = {
    "libration": {},
    "small": {"v0": ["0.001"], "x0": ["0.002"]},
    "rotation": {"v0": [3]},
    "backward rotation from another turn": {"x0": [11], "v0": [-3]},
    "libration in another turn": {"x0": [-7], "v0": ["0.1"]},
    "near the separatrix": {"x0": ["0.1"], "v0": ["1.997"]},
    "separatrix": {"x0": [0], "v0": [2]},
    "backward separatrix": {"x0": [0], "v0": [-2]},
    "hanging": {"x0": [0], "v0": [0]},
    "other parameters": {"parameters": {"mass": 3, "length": "1/3", "gravity": "9.81"}},
}
KEPLER = {
    "e = 0.6": {},
    "circle": {"x0": [1, 0], "v0": [0, 1]},
    "inclined to the axes": {"x0": ["-0.6", "0.2"], "v0": ["0.4", -1]},
    "hyperbola": {"v0": [1, 3]},
}
BODY = {
    "about the largest moment": {},
    "about the smallest moment": {"v0": [1, "0.3", "0.2"]},
    "negative": {"v0": ["0.1", "-0.5", -1]},
    "axes in another order": {"v0": [1, -2, "1/3"], "parameters": {"inertia": [3, 1, 2]}},
    "oblate": {"v0": [1, 1, 1], "parameters": {"inertia": [1, 1, "3/2"]}},
    "prolate": {"v0": [1, 1, 1], "parameters": {"inertia": [2, 1, 2]}},
    "sphere": {"v0": [1, 2, 3], "parameters": {"inertia": [2, 2, 2]}},
    "middle axis": {"v0": [0, 1, 0]},
    "separatrix": {"v0": [sympy.sqrt(3), "0.3", 1]},
    "other branch of the separatrix": {"v0": [sympy.sqrt(3), "0.3", -1]},
    "third branch of the separatrix": {"v0": [-sympy.sqrt(3), "0.3", 1]},
}
CASES = [
    pytest.param(name, change, id=f"{name}: {case}")
    for name, cases in (
        ("harmonic", {"plain": {}, "other": {"v0": ["-0.7"], "parameters": {"stiffness": "2/3"}}}),
        ("pendulum", PENDULUM),
        ("kepler", KEPLER),
        ("rigid-body", BODY),
    )
    for case, change in cases.items()
]
TIMES = (Fraction("4.3"), Fraction(-2))


def blocks(found):
    attitude = [] if found.attitude is None else list(found.attitude)
    return {"x": found.x, "v": found.v, "mu": found.mu, "attitude": attitude}


@pytest.mark.parametrize("name, change", CASES)
def test_taylor_agrees_to_45_digits(name, change):
    scene = scenes.get(name).with_values(**change)
    attitude = name == "rigid-body"
    taylor = certified_integration(scene, list(TIMES), 48, attitude)
    for t in TIMES:
        closed = solution(scene, t, attitude=attitude)
        assert closed.method.startswith("closed form")
        assert closed.certain_digits == 50
        agreed = agreement(blocks(closed), blocks(taylor[t]), {})
        assert agreed >= 45, f"{name} {change} t={t}: {closed} against {taylor[t]}"


def test_a_scene_of_the_same_name_with_another_lagrangian_is_integrated():
    """Negative control: neither a closed form nor a remembered solution may answer for it."""
    scene = scenes.get("pendulum")
    tilted = replace(scene, lagrangian=lambda x, v, p: scene.lagrangian(x, v, p) + x[0] / 10**12)
    plain, other = solution(scene, 3), solution(tilted, 3)
    assert plain.method.startswith("closed form") and other.method == "Taylor series"
    assert 5 <= agreement(blocks(plain), blocks(other), {}) <= 14


def test_a_constant_in_the_lagrangian_changes_nothing():
    scene = scenes.get("pendulum")
    shifted = replace(scene, lagrangian=lambda x, v, p: scene.lagrangian(x, v, p) - 5)
    assert solution(shifted, 3).method.startswith("closed form")
    assert solution(shifted, 3).x == solution(scene, 3).x


def test_many_digits():
    assert solution("rigid-body", 10, digits=300, attitude=True).certain_digits == 300
    assert solution("pendulum", 10, digits=300).certain_digits == 300
