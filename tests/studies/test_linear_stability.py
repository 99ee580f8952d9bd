"""Intervals of stability: where the eigenvalues of a step leave the unit circle."""

import math

import mpmath
import numpy as np
import pytest

from discmech import black_box
from discmech.integrators import discretisation, imex, midpoint, one_step, trapezoidal
from discmech.integrators import rules as discretisations
from discmech.studies.core import controls
from discmech.studies.stability.linear_stability import (
    Oscillator,
    Spectrum,
    resonances,
    spectra,
    unstable_intervals,
)
from discmech.studies.stability.trace import DIGITS, StableSet, stable_set
from tests.studies.cached_results import measured


@pytest.mark.dear("trapezoidal")
@pytest.mark.parametrize("rule", ["trapezoidal", "rectangle"])
def test_stormer_verlet_is_stable_to_two(rule):
    """tr M = 2 − z² (Hairer, Lubich, Wanner, I.5.2)."""
    problem = Oscillator(discretisations.get(rule))
    ((first, last),) = unstable_intervals(problem.matrix)
    assert f"{first:.6f}" == "2.000000" and last == 1000
    assert not problem.grows(0.999 * first) and problem.grows(1.001 * first)
    found = resonances(problem.matrix)
    assert found["1:3"] == pytest.approx(math.sqrt(3), abs=1e-12)
    assert found["1:4"] == pytest.approx(math.sqrt(2), abs=1e-12)


@pytest.mark.dear("rule1")
@pytest.mark.parametrize("rule", [midpoint, imex])
def test_midpoint_has_no_end(rule):
    """tr M = 2 (1 − z²/4)/(1 + z²/4)."""
    problem = Oscillator(rule)
    assert unstable_intervals(problem.matrix) == [] and not problem.grows(1000.0)
    assert resonances(problem.matrix)["1:4"] == pytest.approx(2, abs=1e-12)


@pytest.mark.slow
def test_a_weighted_rule_has_the_end_that_its_weights_give():
    """Of w at the middle and 1 − w at the ends: stable to z = 2/√(1 − w)."""

    @discretisation()
    def weighted(L, G, x, u, h):
        ends = (L(x, u) + L(G.target(x, u, h), u)) / 2
        return h * (3 * L(G.target(x, u, h / 2), u) + ends) / 4

    ((first, _),) = unstable_intervals(Oscillator(weighted).matrix)
    assert first == pytest.approx(4, abs=1e-9)


def test_a_narrow_interval_between_grid_points_is_found():
    """A rotation by z, stretched where z is within 0.001 of 3.1415: |tr M| > 2 only there."""

    def step(z):
        stretch = 2e-6 - (z - 3.1415) ** 2
        trace = 2 * math.cos(math.pi * z / 3.1415) - max(stretch, 0.0) * 2
        return np.array([[trace, -1.0], [1.0, 0.0]])

    found = [pair for pair in unstable_intervals(step) if pair[0] < 4]
    assert len(found) == 1 and 3.139 < found[0][0] < 3.1415 < found[0][1] < 3.144


def test_the_krein_signature_changes_with_the_sense_of_rotation():
    for angle, sign in ((0.3, 1), (-0.3, -1)):
        turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        assert Spectrum.of(1.0, turn).krein == sign
    assert Spectrum.of(1.0, np.diag([2.0, 0.5])).krein == 0
    assert {s.krein for s in spectra(Oscillator(trapezoidal).matrix) if s.z < 1.99} == {1}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["explicit Euler", "classical Runge-Kutta", "Heun"])
def test_what_is_not_symplectic_leaves_the_circle(name):
    rule = controls.RUNGE_KUTTA[name]
    assert Oscillator(rule).off_circle(1.0, proved=False) is not None
    found = measured("stability", "harmonic", rule.name, control=name)
    assert found["verdict"] == "pass" and found["control"]


def test_a_symplectic_rule_in_the_place_of_a_control_is_missed():
    found = measured("stability", "harmonic", "trapezoidal", control="explicit Euler")
    assert found["verdict"] == "fail" and "not caught" in found["reason"]


@pytest.mark.slow
@pytest.mark.parametrize(("rule", "wrong"), [
    ("trapezoidal", [(1.5, 1000.0)]), ("newmark-0.5-1_6", []),
])  # fmt: skip
def test_an_interval_that_runs_contradict_fails(monkeypatch, rule, wrong):
    """One that is too short, and one without an end of a method that is stable to √12."""
    monkeypatch.setattr(Oscillator, "proved", lambda problem: StableSet(wrong, []))
    found = measured("stability", "harmonic", rule)
    assert found["verdict"] == "fail" and "contradict" in found["reason"]


def test_intervals_are_those_of_every_z():
    """Of lobatto-5 a stable window lies between two points of the grid, which says unstable."""
    ends = np.array(Oscillator(discretisations.get("lobatto-5")).proved().unstable)
    assert ends[2:] == pytest.approx(np.array([[8.254550537, 13.043193702], [13.540623445, 1000]]))
    problem = Oscillator(discretisations.get("lobatto-5"))
    assert not problem.grows(13.3) and problem.grows(13.0, 100) and problem.grows(13.6, 100)


def test_ends_and_touched_points_are_known_to_the_last_bit():
    """Roots of 8, 12 and 24; a step of gauss-3 is a half turn at √10 and a whole one at √60."""
    lobatto, gauss = (Oscillator(discretisations.get(f"{name}-3")).proved()
                      for name in ("lobatto", "gauss"))  # fmt: skip
    assert lobatto.unstable == [(8**0.5, 12**0.5), (24**0.5, 1000.0)]
    assert gauss.unstable == [] and gauss.touched == [10**0.5, 60**0.5]


def test_a_step_that_is_no_rational_function_is_told_on_a_grid():
    def cosine(z):
        with mpmath.workdps(DIGITS):
            return 2 * mpmath.cos(mpmath.mpf(z.numerator) / z.denominator)

    assert stable_set(cosine, 1000.0) is None


def test_a_damping_far_below_round_off_of_a_grid_is_no_symplectic_step():
    @one_step(groupoids="pair")
    def damped(s, z, h):
        x, mu = s.split(z)
        mu = mu + h / 2 * s.split(s.f(z))[1]
        x = x + h * s.split(s.f(s.join(x, mu)))[0]
        mu = mu + h / 2 * s.split(s.f(s.join(x, mu)))[1]
        return s.join(x, mu * (1 - h / 10**14))

    problem = Oscillator(damped)
    problem.proved()
    assert problem.off_circle(2.0, proved=True) is not None
    sound = Oscillator(midpoint)
    sound.proved()
    assert sound.off_circle(1000.0, proved=True) is None


@pytest.mark.parametrize("oblique", [0.0, 1.0, -30.0])
def test_a_long_ellipse_is_no_growth(oblique):
    """x to and fro by 10⁴ where μ goes by 1, upright or oblique."""
    problem, shear = Oscillator(midpoint), np.array([[1.0, 0.0], [oblique, 1.0]])
    wide = np.linalg.inv(shear) @ [[0.0, 1e4], [-1e-4, 0.0]] @ shear
    problem.matrix = lambda z: wide
    problem._end = lambda z, steps, x0, mu0: list(np.linalg.matrix_power(wide, 101) @ [x0, mu0])
    assert not problem.grows(1.0)


@pytest.mark.parametrize("kick", [1, -40])
def test_an_interval_without_an_end_is_no_growth(kick):
    """Newmark with β = 1/4 between kicks that undo each other: bounded at every hω."""

    @one_step(implicit=True, groupoids="pair")
    def kicked(s, z, Z, h):
        def moved(z):
            return z + s.join(0 * s.split(z)[0], kick * h * s.split(s.f(z))[1])

        return moved(Z) - moved(z) - h * s.f((moved(z) + moved(Z)) / 2)

    problem = Oscillator(kicked)
    assert problem.proved().unstable == [] and not any(map(problem.grows, (10.0, 100.0, 1000.0)))


@pytest.mark.dear("[0")
@pytest.mark.parametrize(("damping", "off"), [(0, None), (1e-9, 0.02)])
def test_a_program_has_the_round_off_of_its_accelerations(damping, off):
    """Newmark with β = 1/4 in accelerations: at hω = 1000 they are 10⁶ times as large as x."""

    @black_box(order=2)
    def newmark(q, p, h, s):
        a = -s.gradient(q, p)
        ahead = q + h * p + h**2 / 4 * a
        one, other = (A + s.gradient(ahead + h**2 / 4 * A, p) for A in (0 * a, 1 + 0 * a))
        after = -one / (other - one)
        return ahead + h**2 / 4 * after, (1 - damping) * (p + h / 2 * (a + after))

    assert Oscillator(newmark).off_circle(1000.0, proved=False) == off
