"""The Taylor integrator and extrapolation: recurrences, convergence law, invariants."""

from fractions import Fraction
from types import SimpleNamespace

import gmpy2
import mpmath
import pytest
import sympy

from discmech.integrators import scenes
from discmech.reference import solution, solutions
from discmech.reference.agreement import agreement
from discmech.reference.equations import equations_of
from discmech.reference.extrapolation import extrapolate
from discmech.reference.series import compile_series
from discmech.reference.states import all_blocks
from discmech.reference.taylor import TaylorSettings, integrate
from tests.reference.elementary import FUNCTIONS, X, one_equation

ALL = ("harmonic", "pendulum", "kepler", "rigid-body", "heavy-top", "lagrange-top")


@pytest.mark.parametrize("rate", FUNCTIONS, ids=str)
def test_recurrences_give_the_derivatives(rate):
    """z_k = (d/dt)^k x / k!, by repeated exact differentiation along the flow."""
    program = compile_series(one_equation(rate))
    with gmpy2.context(gmpy2.get_context(), precision=200):
        start = [gmpy2.mpfr(3) / 4]
        series = program.coefficients(5, start, program.constants_at(60))[0]
    derivative = X
    for k in range(5):
        expected = (derivative / sympy.factorial(k)).subs(X, sympy.Rational(3, 4)).evalf(50)
        got = sympy.Float(str(series[k]), 50)
        assert abs(got - expected) <= abs(expected) * sympy.Float("1e-45"), (k, got, expected)
        derivative = derivative.diff(X) * rate


@pytest.mark.parametrize("name", ALL)
def test_taylor_and_extrapolation_agree(name):
    """Two methods, two printers of the equations; forward, backward and several times."""
    equations = equations_of(scenes.get(name))
    times = [Fraction(-1), Fraction(0), Fraction(1, 3), Fraction(5)]
    taylor = integrate(equations, compile_series(equations), times, TaylorSettings(53))
    other = extrapolate(equations, times, 53)
    one, two = all_blocks(equations, taylor, 61), all_blocks(equations, other, 61)
    for t in times:
        assert agreement(one[t], two[t], {}) >= 50


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


def test_order_of_the_local_polynomial():
    """Fixed low order, halved offsets: the error of the polynomial falls with its order + 1."""
    equations = equations_of(scenes.get("pendulum"))
    program, order = compile_series(equations), 9
    exact = {n: solution("pendulum", Fraction(1, n), digits=40).x[0] for n in (16, 32)}
    with gmpy2.context(gmpy2.get_context(), precision=200):
        from discmech.reference.exact import to_mpf
        from discmech.reference.taylor import polynomial

        series = program.coefficients(
            order, [gmpy2.mpfr(2), gmpy2.mpfr(0)], program.constants_at(60)
        )
        errors = {
            n: abs(to_mpf(polynomial(series[0], gmpy2.mpfr(1) / n)) - exact[n]) for n in exact
        }
    assert mpmath.log(errors[16] / errors[32], 2) == pytest.approx(order + 1, abs=0.1)


@pytest.mark.parametrize("name", ALL)
def test_energy_to_the_digits(name):
    scene = scenes.get(name)
    equations = equations_of(scene)
    energy = sympy.lambdify(
        equations.states, equations.energy, "mpmath"
    )  # exact rationals become quotients of mpf
    found = solutions(scene, [0, 3, -2], digits=50)
    with mpmath.workdps(70):
        start, *later = [energy(*s.x, *s.v) for s in found]
        assert all(abs(e - start) <= 1e-49 * max(1, abs(start)) for e in later)


@pytest.mark.parametrize("name", ["heavy-top", "lagrange-top"])
def test_casimirs_and_attitude_of_tops(name):
    """mu.Gamma, |Gamma|; A is orthogonal and Gamma(t) = Gamma(0) A."""
    start, found = solutions(name, [0, 5], attitude=True)
    with mpmath.workdps(70):
        tiny = mpmath.mpf(10) ** -49
        for a, b in ((found.x, found.mu), (found.x, found.x)):
            c, d = (start.x, start.mu) if b is found.mu else (start.x, start.x)
            assert abs(mpmath.fdot(a, b) - mpmath.fdot(c, d)) < tiny
        turn = found.attitude
        assert mpmath.mnorm(turn.T * turn - mpmath.eye(3)) < tiny
        carried = mpmath.matrix([start.x]) * turn
        assert mpmath.mnorm(carried - mpmath.matrix([found.x])) < tiny


@pytest.mark.parametrize("v0", [["0.7", "0.6", "0.5"], [1, "0.3", "0.2"]])
def test_spatial_momentum_of_the_free_body(v0):
    scene = scenes.get("rigid-body").with_values(v0=v0)
    start, found = solutions(scene, [0, 10], attitude=True)
    with mpmath.workdps(70):
        turn = found.attitude
        drift = turn * mpmath.matrix(found.mu) - mpmath.matrix(start.mu)
        assert mpmath.mnorm(drift) < mpmath.mpf(10) ** -49
        assert mpmath.mnorm(turn.T * turn - mpmath.eye(3)) < mpmath.mpf(10) ** -49


def test_taylor_backwards_returns():
    """From the state at t = 2 back by 2, with the velocities as exact starting data."""
    scene = scenes.get("lagrange-top")
    there = solution(scene, 2, digits=60)
    with mpmath.workdps(80):
        exact = [sympy.Rational(mpmath.nstr(c, 72)) for c in (*there.x, *there.v)]
    back = SimpleNamespace(
        name=scene.name, groupoid=scene.groupoid, lagrangian=scene.lagrangian,
        parameters=scene.parameters, x0=exact[:3], v0=exact[3:],
    )  # fmt: skip
    found = solution(back, -2, digits=55)
    for got, wanted in zip(found.x, scene.x0, strict=True):
        with mpmath.workdps(80):
            assert abs(got - mpmath.mpf(wanted.numerator) / wanted.denominator) < 1e-54
