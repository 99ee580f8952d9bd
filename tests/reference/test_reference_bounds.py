"""Bounds of references: never below the error and near it, in every operation and scene."""

from dataclasses import replace
from fractions import Fraction
from functools import cache
from types import SimpleNamespace

import mpmath
import numpy as np
import pytest
import sympy

from discmech.integrators import scenes
from discmech.reference import solution
from discmech.reference.answer import bounded, frozen
from discmech.reference.enclosure import enclose
from discmech.reference.equations import equations_of, to_mpf
from discmech.reference.failures import Unproven
from discmech.reference.taylor import TaylorSettings, compile_series, integrate
from discmech.reference.taylor.balls import upper
from tests.reference.elementary import FUNCTIONS, one_equation
from tests.reference.test_reference_proof import contains_derivatives

CUT_OFF = TaylorSettings(18, guard=20)  # the truncation makes the error
ROUNDED = TaylorSettings(30, guard=0)  # the arithmetic makes it
TIMES = [Fraction(1, 9), Fraction(-1, 20), Fraction(1, 4)]

#: a second each
LONG = ("outer-solar-system", "double-spherical-pendulum", "pivoted-body", "fpu", "bead-on-hoop",
        "ball-in-cylinder")  # fmt: skip


def overshoot(equations, times, settings):
    """The largest |error| over its bound, at all times and states; and the largest bound."""
    program = compile_series(equations)
    found = enclose(equations, program, times, settings)
    best = integrate(equations, program, times, TaylorSettings(settings.digits + 30, guard=30))
    assert found.held >= set(times)
    worst, largest = 0, 0
    with mpmath.workdps(100):
        for t in times:
            for z, y, bound in zip(
                found.sweep.states[t], best.states[t], found.bounds[t], strict=True
            ):
                error, bound = abs(to_mpf(z) - to_mpf(y)), upper(bound)
                worst = max(worst, error / bound if error else 0)
                largest = max(largest, bound)
    return worst, largest


@pytest.mark.sampled
@pytest.mark.parametrize("settings", [CUT_OFF, ROUNDED], ids=["cut off", "rounded"])
@pytest.mark.parametrize("rate", FUNCTIONS, ids=str)
def test_bounds_hold_for_every_operation(rate, settings):
    if any(op[0] == "integral" for op in compile_series(one_equation(rate)).operations):
        with pytest.raises(Unproven, match="no remainder of"):
            overshoot(one_equation(rate), TIMES, settings)
        return
    worst, largest = overshoot(one_equation(rate), TIMES, settings)
    assert worst <= 1
    assert largest < mpmath.mpf(10) ** (5 - settings.digits)


@pytest.mark.dear("wong", "edge", "double")
@pytest.mark.parametrize(("name", "settings"), [
    pytest.param(name, (CUT_OFF, ROUNDED)[k], id=f"{name}-{('cut off', 'rounded')[k]}",
                 marks=pytest.mark.slow if (2 * k + number) % 4 or name in LONG else ())  # in turn
    for number, name in enumerate(frozen.names()) for k in range(2)
])  # fmt: skip
def test_bounds_hold_for_every_scene(name, settings):
    assert scene_overshoot(name, settings)[0] <= 1


@pytest.mark.dear("disc", "heavy", "suslov", "contact", "cartesian")
@pytest.mark.parametrize("name", [
    pytest.param(name, marks=pytest.mark.slow if name in LONG or number % 2 == 0 else ())
    for number, name in enumerate(frozen.names())
])  # fmt: skip
def test_bounds_are_near_the_error_in_every_scene(name):
    """They lose eight digits at most, or, where the motion itself has lost more, four to it."""
    nearest, largest = scene_overshoot(name, ROUNDED)
    assert largest < mpmath.mpf(10) ** (8 - ROUNDED.digits) or nearest > 1e-4


@pytest.mark.slow
def test_bounds_are_near_the_error_where_states_grow_on_the_way():
    """From a perihelion that is 10^4 times nearer than the aphelion: eight digits, as above."""
    start = {"x0": ["1/10000", 0], "v0": [0, sympy.sqrt(19999)]}
    equations = equations_of(scenes.get("kepler").with_values(**start))
    overs, largest = overshoot(equations, [Fraction(3, 10)], TaylorSettings(30, guard=20))
    assert overs <= 1 and largest < mpmath.mpf(10) ** (8 - 30)


@cache
def scene_overshoot(name, settings):
    scene = scenes.get(name)
    span = min(Fraction(3), 60 * scene.step)  # digits are lost with each turn of a stiff scene
    return overshoot(equations_of(scene), [span, -span / 3], settings)


@pytest.mark.slow
@pytest.mark.parametrize("name", frozen.names())
def test_jacobians_over_boxes_hold_those_at_points(name):
    equations = equations_of(scenes.get(name))
    # an elimination of multipliers divides by balls, which are as wide as the box
    size = 0.001 if scenes.get(name).all_constraints else 0.01
    contains_derivatives(equations, np.array([float(s) for s in equations.start]), size)


@pytest.mark.slow
def test_what_cannot_be_proven_is_said(monkeypatch):
    """A logarithm has no remainder here: two settings agree. A dear proof is left at its defect."""
    scene = scenes.get("harmonic")
    vortex = replace(
        scene, lagrangian=lambda x, v, p: v[0] ** 2 / 2 - sympy.log(1 + x[0] ** 2) ** 2
    )
    found = solution(vortex, 3, digits=30)
    assert found.certainty == "agreement" and found.certain_digits == 30 and found.bound is None
    assert "two Taylor integrations" in found.evidence and "no bound" not in found.method
    monkeypatch.setattr(bounded, "PRICE", -1)
    found = solution("heavy-top", 2, digits=33)
    assert found.certainty == "defect bound" and found.bound < 1e-33
    assert "to first order" in found.evidence


def attempts(monkeypatch, certain, lost=2.5, held=lambda digits: True, unproven=0.0):
    """(digits, proving) of all runs for 30 digits, and what the last one was, by faked bounds.

    certain: digits had of digits run with; lost, unproven: what the two pilots lose.
    """
    runs = []

    def enclose(equations, program, times, settings, proving):
        runs.append((settings.digits, proving))
        both = {0, 1} if held(settings.digits) else {0}
        return SimpleNamespace(held=both, sweep=len(runs), proving=proving)

    def findings(equations, bounds, found, settings):
        bound = mpmath.mpf(10) ** ((lost if found.proving else unproven) - settings.digits)
        one = SimpleNamespace(certain=certain(settings.digits), bound=bound)
        return {0: SimpleNamespace(certain=99, bound=mpmath.mpf(0)), 1: one}

    for name, fake in (("enclose", enclose), ("_findings", findings), ("BlockBounds", str)):
        monkeypatch.setattr(bounded, name, fake)
    found, sweep, settings = bounded.bounded_integration(None, None, [1], 30)
    assert sweep == len(runs) and settings.digits == runs[-1][0] and set(found) == {0, 1}
    return runs


@pytest.mark.parametrize(("certain", "digits"), [
    (lambda d: d - 4, [34]),  # 30 and the 2.5 that the pilot lost, rounded up, and one
    (lambda d: d - 10, [34, 41]),  # 24 are had: seven more
    (lambda d: d - 5, [34, 36]),  # at least two
    (lambda d: {34: 21}.get(d, 40), [34, 44]),  # ten more than nine that lack
    (lambda d: {34: 24, 41: 26}.get(d, 30), [34, 41, 59]),  # of seven two were gained
    (lambda d: {34: 10, 55: 29}.get(d, 40), [34, 55, 58]),  # 19 of 21
    (lambda d: {34: 24}.get(d, 29), [34, 41, 44]),  # 5 of 7
    (lambda d: {34: 20, 45: 20}.get(d, 40), [34, 45, 56]),  # none
    (lambda d: {34: 20, 45: 18}.get(d, 40), [34, 45, 58]),  # two were lost
    (lambda d: {34: 24, 41: 40}.get(d, 0), [34, 41]),
    (lambda d: 0, [34, 65, 96]),  # three times and no more
])  # fmt: skip
def test_more_digits_are_taken_until_the_bound_is_small_enough(monkeypatch, certain, digits):
    assert attempts(monkeypatch, certain) == [(18, True), *((d, True) for d in digits)]


def test_what_the_tube_does_not_hold_is_tried_with_fifteen_digits_more(monkeypatch):
    runs = attempts(monkeypatch, lambda d: d, held=lambda d: d > 50)
    assert [d for d, _ in runs] == [18, 34, 49, 64]
    kept = attempts(monkeypatch, lambda d: d, held=lambda d: d > 40)
    assert [d for d, _ in kept] == [18, 34, 49]


def test_a_proof_may_cost_thirty_digits_more_than_its_estimate(monkeypatch):
    def runs(lost, unproven):
        return attempts(monkeypatch, lambda d: 99, lost=lost, unproven=unproven)

    assert runs(29.5, 0) == [(18, True), (61, True)]
    assert runs(39.5, 10) == [(18, True), (18, False), (71, True)]
    assert runs(40.5, 10) == [(18, True), (18, False), (41, False)]
    assert runs(149.5, 130) == [(18, True), (18, False), (181, True)]
    with pytest.raises(Unproven, match="it would cost 151 digits"):
        runs(151, 140)
    assert runs(-3, 0) == [(18, True), (31, True)]  # nothing is lost
    assert bounded._lost({0: SimpleNamespace(bound=0)}, TaylorSettings(18)) == 0
