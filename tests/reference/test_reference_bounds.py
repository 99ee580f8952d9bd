"""Bounds of references: never below the error, in every operation and scene; wrong ones caught."""

from dataclasses import replace
from fractions import Fraction
from functools import cache

import gmpy2
import mpmath
import numpy as np
import pytest
import sympy
from flint import arb

from discmech.integrators import scenes
from discmech.reference import solution
from discmech.reference.answer import bounded, frozen
from discmech.reference.enclosure import enclose, remainders, tube
from discmech.reference.equations import equations_of, to_mpf
from discmech.reference.failures import Unproven
from discmech.reference.taylor import TaylorSettings, compile_series, integrate
from discmech.reference.taylor.balls import BallRates, upper, working
from tests.reference.elementary import FUNCTIONS, X, one_equation

CUT_OFF = TaylorSettings(18, guard=20)  # the truncation makes the error
ROUNDED = TaylorSettings(30, guard=0)  # the arithmetic makes it
TIMES = [Fraction(1, 9), Fraction(-1, 20), Fraction(1, 4)]

LONG = ("outer-solar-system", "double-spherical-pendulum", "pivoted-body", "fpu")  # a second each


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


@pytest.mark.parametrize(("name", "settings"), [
    pytest.param(name, (CUT_OFF, ROUNDED)[k], id=f"{name}-{('cut off', 'rounded')[k]}",
                 marks=pytest.mark.slow if (k + number) % 2 or name in LONG else ())  # in turn
    for number, name in enumerate(frozen.names()) for k in range(2)
])  # fmt: skip
def test_bounds_hold_for_every_scene(name, settings):
    assert scene_overshoot(name, settings)[0] <= 1


@pytest.mark.parametrize("name", [
    pytest.param(name, marks=pytest.mark.slow if name in LONG or number % 2 == 0 else ())
    for number, name in enumerate(frozen.names())
])  # fmt: skip
def test_bounds_are_near_the_error_in_every_scene(name):
    """They lose eight digits at most, or, where the motion itself has lost more, four to it."""
    nearest, largest = scene_overshoot(name, ROUNDED)
    assert largest < mpmath.mpf(10) ** (8 - ROUNDED.digits) or nearest > 1e-4


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


WRONG = [X**2, sympy.exp(X), sympy.sin(X), 1 / (1 + X**2), X ** sympy.Rational(1, 3)]


@pytest.mark.parametrize("rate", WRONG, ids=str)
def test_bounds_without_the_cut_off_are_caught(monkeypatch, rate):
    monkeypatch.setattr(remainders, "high", lambda a, b: gmpy2.mpfr(0))
    assert overshoot(one_equation(rate), TIMES, CUT_OFF)[0] > 10


@pytest.mark.parametrize("rate", WRONG, ids=str)
def test_bounds_for_a_better_arithmetic_are_caught(monkeypatch, rate):
    """Ten digits fewer than the bounds are told."""

    def rougher(equations, program, times, settings, watch):
        return integrate(equations, program, times, replace(settings, guard=-10), watch=watch)

    monkeypatch.setattr(tube, "integrate", rougher)
    assert overshoot(one_equation(rate), TIMES, ROUNDED)[0] > 10


def test_a_bound_that_does_not_grow_is_caught(monkeypatch):
    """x = exp(-rt), r^2 = 2, on a saddle, where an error of rounding grows like exp(rt)."""
    scene = replace(
        scenes.get("harmonic"),
        v0=(-sympy.sqrt(2),),
        lagrangian=lambda x, v, p: v[0] ** 2 / 2 + x[0] ** 2,
    )
    equations = equations_of(scene)
    assert overshoot(equations, [Fraction(15)], ROUNDED)[0] <= 1
    right = BallRates.__call__
    monkeypatch.setattr(BallRates, "__call__", lambda self, box: (0, 0 * right(self, box)[1]))
    assert overshoot(equations, [Fraction(15)], ROUNDED)[0] > 1000


@pytest.mark.parametrize("name", [
    pytest.param(name, marks=pytest.mark.slow if name in LONG else ()) for name in frozen.names()
])  # fmt: skip
def test_jacobians_over_boxes_hold_those_at_points(name):
    equations = equations_of(scenes.get(name))
    # an elimination of multipliers divides by balls, which are as wide as the box
    size = 0.001 if scenes.get(name).constrained else 0.01
    contains_derivatives(equations, np.array([float(s) for s in equations.start]), size)


@pytest.mark.parametrize("rate", FUNCTIONS, ids=str)
def test_derivatives_over_boxes_hold_those_at_points(rate):
    contains_derivatives(one_equation(rate), np.array([0.75]))


def contains_derivatives(equations, centre, size=0.01):
    """Exact derivatives are those along imaginary steps, where nothing is lost by cancellation."""
    functions = [{"Abs": lambda z: z * np.sign(z.real)}, "numpy"]  # |z| is not analytic
    rates = sympy.lambdify(
        equations.states, equations.rates, functions, cse=lambda e: (equations.assignments, e)
    )
    radius = size * (1 + abs(centre))
    random = np.random.default_rng(7)
    points = centre + radius * random.uniform(-1, 1, (20, len(centre)))
    along = points[:, None] + 1e-30j * np.eye(len(centre))  # point, direction, coordinate
    values = np.array([rate + 0 * along[..., 0] for rate in rates(*np.moveaxis(along, -1, 0))])
    exact = np.moveaxis(values.imag / 1e-30, 0, 1)
    with working():
        box = [arb(z, r) for z, r in zip(centre, radius, strict=True)]
        _, over = BallRates(compile_series(equations))(box)
        for jacobian in exact:
            for at, ball in zip(jacobian.ravel(), over.entries(), strict=True):
                assert ball.overlaps(arb(float(at), 1e-14 * (1 + abs(float(at)))))
        most = max(float(e.mid().abs_upper()) for e in over.entries())
        assert all(e.rad() < 1 + 2 * most for e in over.entries())


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


def test_a_path_near_a_pole_of_a_step_is_no_proof():
    """A step over which a denominator may vanish is refused, not bounded."""
    program = compile_series(one_equation(1 / X))
    with gmpy2.context(gmpy2.get_context(), precision=100):
        state, size = [gmpy2.mpfr(1)], gmpy2.mpfr(-3) / 4  # x^2 = 1 + 2t is zero at t = -1/2
        nodes = program.nodes(20, state, [])
    from discmech.reference.enclosure.majorants import upward
    from discmech.reference.taylor import Step

    with upward(), pytest.raises(Unproven, match="near zero"):
        remainders.Remainders(program, Step(nodes, size, []), 20, 100)
