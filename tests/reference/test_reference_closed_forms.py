"""Closed forms against the Taylor integrator, which knows none of them."""

import re
from dataclasses import replace
from fractions import Fraction

import mpmath
import pytest
import sympy

from discmech.integrators import scenes
from discmech.reference import solution
from discmech.reference.answer.agreement import agreement
from discmech.reference.answer.certify import form_at
from discmech.reference.answer.problem import Problem
from discmech.reference.closed_forms import registry
from discmech.reference.closed_forms.form import is_zero, sign
from discmech.reference.closed_forms.kepler import increasing_root
from discmech.reference.enclosure import enclose
from discmech.reference.equations import equations_of, parameter_values, to_mpf
from discmech.reference.failures import Unproven
from discmech.reference.taylor import TaylorSettings, compile_series

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
    "e = 0.99": {"x0": ["1/100", 0], "v0": [0, sympy.sqrt(199)]},
    "e = 0.9999": {"x0": ["1/10000", 0], "v0": [0, sympy.sqrt(19999)]},
}
SENSITIVE = ("e = 0.9999",)  # slow, and more than 58 digits are needed to prove 45
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
MORSE = {
    "plain": {},
    "inwards, on the wall": {"x0": ["-0.4"], "v0": ["-0.2"]},
    "near the edge": {"x0": [2], "v0": ["0.8"]},
    "other parameters": {"x0": ["-1/2"], "parameters": {"mass": "1/3", "depth": 5, "width": -2}},
}
LAKSHMANAN = {
    "plain": {},
    "negative curvature": {"v0": ["-0.3"], "parameters": {"curvature": "-1/2", "frequency": 2}},
}
#: whose denominator 1 + λx² no enclosure of a step of so high an order holds away from zero: its
#: reference rests on the closed form
UNPROVEN = ("mathews-lakshmanan",)
CASES = [
    pytest.param(
        name,
        change,
        62 if case in SENSITIVE else 58,
        id=f"{name}: {case}",
        marks=pytest.mark.slow if case != next(iter(cases)) else (),
    )
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
        ("morse", MORSE),
        ("mathews-lakshmanan", LAKSHMANAN),
    )
    for case, change in cases.items()
]
TIMES = (Fraction(-1), Fraction("0.3"), Fraction("2.7"))
REGIMES = [pytest.param(*case.values[:2], id=case.id) for case in CASES]


@pytest.mark.dear("top: hanging", "top: falling", "pendulum: plain", "top: without spin",
                  "top: prolate, below", "top: not of unit length", "-pendulum: other parameters",
                  "so4: in the first three axes")  # fmt: skip
@pytest.mark.parametrize("name, change", REGIMES)
def test_it_begins_at_the_start_and_its_rate_is_the_equations(name, change):
    """In every regime; so it is the solution. The central quotient is off by the square of h."""
    scene = scenes.get(name).with_values(**change)
    equations = equations_of(scene, registry()[name].attitude)
    form, h = Problem.of(scene).form(), Fraction(1, 10**15)
    rates = sympy.lambdify([equations.states], list(equations.rates), "mpmath",
                           cse=lambda e: ([*equations.assignments], e))  # fmt: skip

    def at(t):
        found = form_at(equations, parameter_values(scene), form, t, 55)
        return [*found["x"], *found["v"], *found.get("attitude", ())]

    with mpmath.workdps(55):
        for number, wanted in zip(at(Fraction(0)), equations.start, strict=True):
            assert abs(number - mpmath.mpf(str(wanted.evalf(60)))) < 1e-45
        for t in (Fraction("-1.3"), Fraction(17)):
            wanted = rates(at(t))
            size = 1 + max(map(abs, wanted))
            for before, after, rate in zip(at(t - h), at(t + h), wanted, strict=True):
                assert abs((after - before) * 10**15 / 2 - rate) < 1e-24 * size


def blocks(found):
    attitude = [] if found.attitude is None else list(found.attitude)
    return {"x": found.x, "v": found.v, "mu": found.mu, "attitude": attitude}


@pytest.mark.dear("rigid", "lagrange", "spherical", "kepler: e = 0.6")
@pytest.mark.parametrize("name, change, digits", CASES)
def test_the_taylor_integrator_encloses_it_to_45_digits(name, change, digits):
    """The closed form lies within the proven bounds, at a time inside a step and at the ends."""
    scene = scenes.get(name).with_values(**change)
    attitude = registry()[name].attitude
    equations = equations_of(scene, attitude)
    form = Problem.of(scene).form()
    if name in UNPROVEN:
        with pytest.raises(Unproven, match="a denominator"):
            enclose(equations, compile_series(equations), TIMES, TaylorSettings(digits))
        return
    taylor = enclose(equations, compile_series(equations), TIMES, TaylorSettings(digits))
    assert taylor.held >= set(TIMES)
    for t in TIMES:
        closed = form_at(equations, parameter_values(scene), form, t, 70)
        numbers = [*closed["x"], *closed["v"], *closed.get("attitude", ())]
        scale = max(map(abs, numbers)) or 1
        states, bounds = taylor.sweep.states[t], taylor.bounds[t]
        with mpmath.workdps(70):
            for number, state, bound in zip(numbers, states, bounds, strict=True):
                assert abs(number - to_mpf(state)) <= bound + 1e-50 * scale
                assert bound <= 1e-45 * scale


def late(form, factor):
    """The same motion at a time that is wrong by this factor."""
    return replace(form, motion=lambda p, x, v, t: form.motion(p, x, v, t * factor))


@pytest.mark.parametrize("proof", [True, False])
def test_a_form_that_is_wrong_in_the_21st_digit_is_no_authority(monkeypatch, proof):
    """Its time scaled by 1 + 1e-20: two precisions of it agree, the Taylor integrator does not."""
    scene = scenes.get("pendulum")
    right = solution(scene, "5.1", proof=proof)
    assert right.certain_digits == 50
    assert right.certainty == ("enclosure" if proof else "agreement")
    assert re.search(r"closed form: .* functions agrees to [56]\d digits", right.evidence)
    wrong = late(registry()["pendulum"], 1 + Fraction(1, 10**20))
    monkeypatch.setattr("discmech.reference.closed_forms.registry", lambda: {"pendulum": wrong})
    found = solution(scene, "5.2", proof=proof)
    assert 18 <= found.certain_digits <= 21 and found.certainty == "agreement"
    assert "fewer than the 50 asked for" in found.evidence


def test_a_scene_of_the_same_name_with_another_lagrangian_is_integrated():
    """Negative control: neither a closed form nor a remembered solution may answer for it."""
    scene = scenes.get("pendulum")
    tilted = replace(scene, lagrangian=lambda x, v, p: scene.lagrangian(x, v, p) + x[0] / 10**12)
    plain, other = solution(scene, 3), solution(tilted, 3)
    assert "closed form" in plain.evidence and "closed form" not in other.evidence
    assert 5 <= agreement(blocks(plain), blocks(other), {}) <= 14


def test_a_constant_in_the_lagrangian_changes_nothing():
    scene = scenes.get("pendulum")
    shifted = replace(scene, lagrangian=lambda x, v, p: scene.lagrangian(x, v, p) - 5)
    assert "closed form" in solution(shifted, 3).evidence
    assert solution(shifted, 3).x == solution(scene, 3).x


NOT_SOLVED = {
    "plane, over the pole": ("spherical-pendulum", {"x0": [1, 0, 0], "v0": [0, 1, 0]}),
    "over the pole, spinning": ("lagrange-top", {"x0": ["3/5", 0, "4/5"], "v0": ["1/3", "1/3", 2]}),
    "through the other pole": ("lagrange-top", {"x0": ["3/5", 0, "4/5"], "v0": [-3, "1/3", 2]}),
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
    assert "closed form" not in found.evidence and found.certain_digits == 20


@pytest.mark.parametrize("failure", [AttributeError, IndexError, TypeError, ValueError, KeyError])
def test_a_scene_with_other_data_has_no_form(monkeypatch, failure):
    """Of its name, but without what the form's Lagrangian asks for; or of another kind."""
    problem, right = Problem.of(scenes.get("rigid-body")), registry()["rigid-body"]

    def form(**changes):
        forms = {"rigid-body": replace(right, **changes)}
        monkeypatch.setattr("discmech.reference.closed_forms.registry", lambda: forms)
        return problem.form()

    def fails(x, v, p):
        raise failure

    if failure is KeyError:  # a slip of ours
        with pytest.raises(KeyError):
            form(lagrangian=fails)
    else:
        assert form(lagrangian=fails) is None
    assert form() is not None and form(kind="action") is None
    assert form(basis=None) is not None and form(basis=lambda: right.basis()[::-1]) is None
    assert form(applies=lambda *_: False) is None


ROOT = sympy.sqrt(2)
NEAR = sympy.Rational(str(ROOT.evalf(70)))


@pytest.mark.parametrize("number, wanted", [
    (0, 0), (sympy.Rational(-1, 10**80), -1), (sympy.Rational(1, 10**80), 1), (ROOT, 1),
    (-ROOT, -1), (ROOT * sympy.sqrt(3) - sympy.sqrt(6), 0), (sympy.exp(-200), 1),
    (-sympy.pi**-150, -1), (sympy.sin(1) ** 2 + sympy.cos(1) ** 2 - 1, 0),
    (sympy.exp(100) * (ROOT - NEAR), 1 if ROOT > NEAR else -1),
], ids=str)  # fmt: skip
def test_the_sign_of_an_exact_number(number, wanted):
    assert sign(number) == wanted and is_zero(number) is (wanted == 0)


def test_the_root_of_an_increasing_function():
    """Far away, of either sign, and where a tangent leads away from it."""
    with mpmath.workdps(50):
        for goal in map(mpmath.mpf, (0, "1e-30", 3, -700, 10**9)):
            for function, slope in (
                (lambda d: d**3 + d / 10**6, lambda d: 3 * d**2 + mpmath.mpf(10) ** -6),
                (mpmath.sinh, mpmath.cosh), (mpmath.asinh, lambda d: 1 / mpmath.hypot(1, d)),
            ):  # fmt: skip
                if function is mpmath.asinh and abs(goal) > 100:
                    continue
                found = increasing_root(function, slope, goal)
                assert abs(function(found) - goal) <= 1e-45 * (abs(slope(found)) + abs(found))


@pytest.mark.parametrize("name", ["rigid-body", "pendulum"])
def test_many_digits(name):
    """At 300 digits the form agrees with itself at 400, and at 100 with the Taylor integrator."""
    scene = scenes.get(name)
    problem = Problem.of(scene)
    equations = equations_of(scene, problem.has_attitude)
    arguments = (equations, parameter_values(scene), problem.form())
    fewer, more = (form_at(*arguments, Fraction(10), working) for working in (315, 400))
    assert agreement(fewer, more, {}) >= 300
    assert solution(scene, 1, digits=100).certain_digits == 100
