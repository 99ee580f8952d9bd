"""Closed forms against the Taylor integrator, which knows none of them."""

from dataclasses import replace
from fractions import Fraction

import mpmath
import pytest
import sympy

from integrators import scenes
from reference import solution, solutions
from reference.agreement import agreement
from reference.closed_forms import registry
from reference.enclosure import enclose
from reference.equations import equations_of
from reference.exact import to_mpf
from reference.series import compile_series
from reference.taylor import TaylorSettings

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
TOP = {
    "nutating": {},
    "falling": {"v0": ["0.3", "-0.4", "0.5"]},
    "from a turning point": {"v0": ["0.4", "0.2", "2.5"]},
    "from the other turning point": {"v0": [1, "1/2", 3]},
    "steady precession": {"x0": ["4/5", 0, "3/5"], "v0": ["8/5", 0, "17/5"]},
    "hanging": {"parameters": {"weight": -2}},
    "prolate, below": {"parameters": {"inertia": [2, 2, "1/3"]}, "x0": ["0.6", 0, "-0.8"]},
    "not of unit length": {"x0": [1, 2, 1]},
    "without spin": {"v0": ["0.3", "0.1", 0]},
}
SPHERICAL = {
    "plain": {},
    "fast": {"v0": [2, -1, "0.5"]},
    "other parameters": {"parameters": {"mass": 2, "length": "1/2", "gravity": "9.81"}},
}
SL2 = {
    "plain": {},
    "other regime": {"v0": ["0.9", "0.2", "-0.1"]},
    "negative": {"v0": ["-0.2", "-0.5", "-0.4"]},
    "separatrix": {"v0": ["1/2", 1, 2 - sympy.sqrt(3)], "parameters": {"inertia": [1, 1, 1]}},
    "other separatrix": {"v0": ["1/2", 2 - sympy.sqrt(3), 1], "parameters": {"inertia": [1, 1, 1]}},
    "other metric": {"parameters": {"inertia": ["1/2", 3, 2]}},
}
MANAKOV = {
    "in the first three axes": {"v0": ["0.5", "-0.3", 0, "0.4", 0, 0]},
    "without the second axis": {"v0": [0, "0.2", "0.3", 0, 0, -1]},
    "one plane": {"v0": [0, 0, 0, 0, "0.7", 0]},
    "two planes, steady": {"v0": ["0.7", 0, 0, 0, 0, "-0.4"]},
}
PARTICLE = {"plain": {}, "other": {"v0": [1, 2, -1], "parameters": {"charge": -3, "mass": "1/3"}}}
CASES = [
    pytest.param(name, change, id=f"{name}: {case}")
    for name, cases in (
        ("harmonic", {"plain": {}, "other": {"v0": ["-0.7"], "parameters": {"stiffness": "2/3"}}}),
        ("pendulum", PENDULUM),
        ("kepler", KEPLER),
        ("rigid-body", BODY),
        ("lagrange-top", TOP),
        ("spherical-pendulum", SPHERICAL),
        ("sl2", SL2),
        ("rigid-body-so4", MANAKOV),
        ("charged-particle", PARTICLE),
    )
    for case, change in cases.items()
]
TIMES = (Fraction(-1), Fraction("0.3"), Fraction("2.7"))


def blocks(found):
    attitude = [] if found.attitude is None else list(found.attitude)
    return {"x": found.x, "v": found.v, "mu": found.mu, "attitude": attitude}


@pytest.mark.parametrize("name, change", CASES)
def test_the_taylor_integrator_encloses_it_to_45_digits(name, change):
    """The closed form lies within the proven bounds, at a time inside a step and at the ends."""
    scene = scenes.get(name).with_values(**change)
    attitude = registry()[name].attitude
    equations = equations_of(scene, attitude)
    taylor = enclose(equations, compile_series(equations), TIMES, TaylorSettings(58))
    assert taylor.held >= set(TIMES)
    for closed in solutions(scene, TIMES, attitude=attitude):
        assert closed.method.startswith("closed form") and closed.certain_digits == 50
        numbers = [*closed.x, *closed.v, *([] if closed.attitude is None else closed.attitude)]
        scale = max(map(abs, numbers)) or 1
        states, bounds = taylor.sweep.states[closed.t], taylor.bounds[closed.t]
        with mpmath.workdps(70):
            for number, state, bound in zip(numbers, states, bounds, strict=True):
                assert abs(number - to_mpf(state)) <= bound + 1e-50 * scale
                assert bound <= 1e-45 * scale


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


NOT_SOLVED = {
    "plane, over the pole": ("spherical-pendulum", {"x0": [1, 0, 0], "v0": [0, 1, 0]}),
    "the sleeping top's separatrix": ("lagrange-top", {"x0": [1, 0, 0], "v0": [0, 0, 0]}),
    "unsymmetric": ("lagrange-top", {"parameters": {"inertia": [1, 2, 3]}}),
    "centre off the axis": ("lagrange-top", {"parameters": {"center": [0, 1, 1]}}),
    "unbounded": ("sl2", {"parameters": {"inertia": [4, 1, 1]}}),
    "genuinely four-dimensional": ("rigid-body-so4", {}),
    "parabola": ("kepler", {"x0": [2, 0], "v0": [0, 1]}),
    "no field": ("charged-particle", {"parameters": {"field": 0}}),
}


@pytest.mark.parametrize("case", NOT_SOLVED)
def test_motions_outside_a_form_s_range_are_integrated(case):
    name, change = NOT_SOLVED[case]
    found = solution(scenes.get(name).with_values(**change), "0.7", digits=20)
    assert found.method == "Taylor series" and found.certain_digits == 20


def test_many_digits():
    assert solution("rigid-body", 10, digits=300, attitude=True).certain_digits == 300
    assert solution("pendulum", 10, digits=300).certain_digits == 300
