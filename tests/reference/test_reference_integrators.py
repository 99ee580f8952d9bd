"""The Taylor integrator and extrapolation: recurrences, convergence law, invariants."""

import math
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import gmpy2
import pytest
import sympy
from sympy import Rational

from discmech.integrators import scenes
from discmech.reference import MotionEnds, ReferenceFailure
from discmech.reference.answer import extrapolation
from discmech.reference.answer.agreement import agreement
from discmech.reference.answer.extrapolation import extrapolate
from discmech.reference.answer.states import all_blocks
from discmech.reference.equations import equations_of, number_to_mpfr
from discmech.reference.taylor import TaylorSettings, compile_series, integrate, safe_step
from tests.reference.elementary import FUNCTIONS, X, one_equation

ALL = ("harmonic", "pendulum", "kepler", "rigid-body", "heavy-top", "lagrange-top")


@pytest.mark.parametrize("highest", [4, pytest.param(5, marks=pytest.mark.slow)])
@pytest.mark.parametrize("rate", FUNCTIONS, ids=str)
def test_recurrences_give_the_derivatives(rate, highest):
    """z_k = (d/dt)^k x / k!, by repeated exact differentiation along the flow."""
    program = compile_series(one_equation(rate))
    with gmpy2.context(gmpy2.get_context(), precision=200):
        start = [gmpy2.mpfr(3) / 4]
        series = program.nodes(5, start, program.constants_at(60))[0]
    derivative = X
    for k in range(highest + 1):
        expected = (derivative / sympy.factorial(k)).subs(X, Rational(3, 4)).evalf(50)
        got = sympy.Float(str(series[k]), 50)
        assert abs(got - expected) <= abs(expected) * sympy.Float("1e-45"), (k, got, expected)
        derivative = derivative.diff(X) * rate


@pytest.mark.parametrize("rate", [*FUNCTIONS, X * 2**40 - 2**20, (X**2 / 3) ** Rational(5, 2)],
                         ids=str)  # fmt: skip
def test_the_second_printer_says_the_same(rate):
    """At a point, in all digits; no number is rounded before it is used."""
    field, numbers = extrapolation.compile_field(one_equation(rate))
    with gmpy2.context(gmpy2.get_context(), precision=200):
        (found,) = field([gmpy2.mpfr(3) / 4], [number_to_mpfr(number, 60) for number in numbers])
    wanted = rate.subs(X, Rational(3, 4)).evalf(70)
    assert abs(sympy.Float(str(found), 70) / wanted - 1) < sympy.Float("1e-55")
    assert all(not number.is_Integer or abs(number) > 2**30 for number in numbers)


@pytest.mark.parametrize("rate, products", [
    (3 * X + 1, 0), (X**2, 1), (X**4, 2), (X**3 - X**2, 2), (1 / X, 1), (sympy.sin(X), 2),
    (sympy.sin(X) * sympy.cos(X), 3),
], ids=str)  # fmt: skip
def test_products_are_counted(rate, products):
    """Each node is one, with its mate; what is linear costs none."""
    assert compile_series(one_equation(rate)).products == products


@pytest.mark.dear("heavy", "kepler")
@pytest.mark.parametrize("name", ALL)
def test_taylor_and_extrapolation_agree(name):
    """Two methods, two printers of the equations; forward, backward and several times."""
    equations = equations_of(scenes.get(name))
    times = [Fraction(-1), Fraction(0), Fraction(1, 3), Fraction(5)]
    taylor = integrate(equations, compile_series(equations), times, TaylorSettings(53))
    other = extrapolate(equations, times, 53)
    assert other.order == 2 * 19  # 0.36 columns a digit, of h² each
    one, two = all_blocks(equations, taylor, 61), all_blocks(equations, other, 61)
    for t in times:
        assert agreement(one[t], two[t], {}) >= 50


def test_extrapolation_takes_the_steps_that_its_tolerance_lets_it(monkeypatch):
    """None is refused but the first, which is tried; one that an end cuts off shortens no other."""
    errors, right = [], extrapolation._basic_step

    def seen(*given):
        after, error = right(*given)
        errors.append(error * 10**53)
        return after, error

    monkeypatch.setattr(extrapolation, "_basic_step", seen)
    equations = equations_of(scenes.get("harmonic"))
    alone = extrapolate(equations, [Fraction(9)], 53)
    assert len(errors) == alone.steps and errors[0] > 1
    assert all(0.01 < e <= 1 for e in errors[1:-1]) and errors[-1] <= 1
    ends = [Fraction(5), Fraction(5) + Fraction(1, 10**6), Fraction(9)]
    assert extrapolate(equations, ends, 53).steps <= alone.steps + 2
    with pytest.raises(ReferenceFailure, match="stops at t = "):
        extrapolate(equations, [Fraction(9)], 53, max_steps=alone.steps - 1)
    assert extrapolate(equations, [Fraction(9)], 53, max_steps=alone.steps).steps == alone.steps
    fall = replace(one_equation(sympy.Integer(2)), start=(sympy.S.Zero,))
    far = extrapolate(fall, [Fraction(10**9)], 20)  # exactly: each step is thrice the last
    assert abs(far.states[10**9][0] / (2 * 10**9) - 1) < 1e-20 and far.steps < 25


@pytest.mark.parametrize("digits, stretch", [(15, 1.0), (50, 1.2), (300, 1.0)])
def test_settings_are_those_of_their_derivation(digits, stretch):
    settings = TaylorSettings(digits, guard=9, stretch=stretch)
    assert 2 ** (settings.precision - 1) < 10 ** (digits + 9) <= 2**settings.precision
    assert 0 < settings.order - stretch * math.log(10**digits) / 2 <= 1 + stretch
    assert TaylorSettings(1).order >= 8


@pytest.mark.parametrize("order", [12, 40])
def test_a_step_is_within_the_radius_and_no_term_grows(order):
    """1/(1 - t/R): the last terms are the tolerance. exp(-kt): no early one is far above the first.

    Both beside a state that is 0.
    """
    tolerance, zeros = gmpy2.mpfr("1e-20"), [gmpy2.mpfr(0)] * (order + 1)
    for radius, scale in ((3, 1), (gmpy2.mpfr("0.01"), 7)):
        pole = [scale * gmpy2.mpfr(radius) ** -k for k in range(order + 1)]
        step = safe_step([zeros, pole], order, tolerance)
        assert abs(step / (radius * tolerance ** (gmpy2.mpfr(1) / (order - 1))) - 1) < 1e-12
        lower = [*pole[:-2], pole[-2] / 1000, pole[-1]]
        step = safe_step([lower, zeros], order, tolerance)
        assert abs(step / (radius * tolerance ** (gmpy2.mpfr(1) / order)) - 1) < 1e-12
    for rate in (5, -300):
        entire = [gmpy2.mpfr(rate) ** k / math.factorial(k) for k in range(order + 1)]
        step = safe_step([entire, zeros], order, gmpy2.mpfr("1e-3"))
        early = [(abs(c), k) for k, c in enumerate(entire[: order // 2])]
        assert max(c * step**k for c, k in early) <= 4
        assert rate == 5 or max(c * (2 * step) ** k for c, k in early) > 4
    still = [[gmpy2.mpfr(5), *zeros[1:]]]
    assert safe_step(still, order, tolerance) == gmpy2.inf()
    from_rest = [[gmpy2.mpfr(0), gmpy2.mpfr(1), *zeros[2:-1], gmpy2.mpfr(1)]]
    assert safe_step(from_rest, order, tolerance) <= tolerance ** (gmpy2.mpfr(1) / order) * 1.001
    for at in (order - 1, order):
        for wrong in (gmpy2.nan(), gmpy2.inf()):
            broken = list(zeros)
            broken[at] = wrong
            assert safe_step([pole, broken], order, tolerance) is None


@pytest.mark.slow
def test_convergence_law():
    """The error is the tolerance times a factor of the problem, at every tolerance."""
    equations = equations_of(scenes.get("heavy-top"))
    program, t = compile_series(equations), Fraction(4)

    def at(digits):
        return all_blocks(
            equations, integrate(equations, program, [t], TaylorSettings(digits)), digits + 8
        )[t]

    best = at(110)
    for digits in (15, 30, 45, 60, 80):
        assert digits - 3 <= agreement(at(digits), best, {}) <= digits + 6


def steps_to(t, radius, max_steps=1000):
    """How many steps lead to t, where the series of step k has this radius of convergence."""
    made = []

    def nodes(order, state, constants):
        made.append(radius(len(made)))
        return [[gmpy2.mpfr(made[-1]) ** -j for j in range(order + 1)]]

    program = SimpleNamespace(name="s", size=1, nodes=nodes, constants_at=lambda digits: [])
    equations = SimpleNamespace(start=(sympy.S.One,), constraints=())
    return integrate(equations, program, [Fraction(t)], TaylorSettings(15), max_steps).steps


@pytest.mark.parametrize("t, radius, said", [
    (10**4, lambda k: 1, "300 lead to"),  # each step is as the last
    (-(10**4), lambda k: 1, "300 lead to"),
    (10**4, lambda k: 1 if k < 300 else 0.01, "300 lead to"),  # what is left, by the longest
    (10**4, lambda k: 2 if 150 < k < 300 else 1, "300 lead to"),
    (10**4, lambda k: 2.1 if 150 < k < 300 else 1, "1000 lead to"),  # they grow
    (10**4, lambda k: 9 if k < 150 else 1, "300 lead to"),
    (10**4, lambda k: 1 if k < 300 else 0.0009, "1000 lead to"),  # they shrink, as at a pole
    (10**4, lambda k: 1 if k < 300 else 0.0011, "300 lead to"),
    (100, lambda k: 1 if k < 301 else 0.001, "1000 lead to"),  # near enough then
])  # fmt: skip
def test_a_run_without_end_is_ended_as_soon_as_it_is_known(t, radius, said):
    with pytest.raises(ReferenceFailure, match=f"more than 1000 steps: {said}"):
        steps_to(t, radius)


def test_steps_are_counted_and_no_more_are_made_than_are_allowed():
    forward = steps_to(40, lambda k: 1)
    assert 250 < forward < 300 and steps_to(-40, lambda k: 1) == forward
    assert steps_to(40, lambda k: 1, max_steps=forward) == forward
    with pytest.raises(ReferenceFailure, match=f"more than {forward - 1} steps"):
        steps_to(40, lambda k: 1, max_steps=forward - 1)
    with pytest.raises(MotionEnds, match=r"stops at t = 1\.") as end:
        steps_to(40, lambda k: 8 if not k else 1e-30)
    assert 1 < end.value.time < 2
