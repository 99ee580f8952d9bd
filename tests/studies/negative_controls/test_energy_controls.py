"""Energies that drift: the study of energy must say no, and to bands that stand it must not."""

from itertools import accumulate

import numpy as np
import pytest
import sympy

from discmech.integrators import Scene, one_step, pair, scenes
from discmech.integrators.equations.arrows import Arrows
from discmech.integrators.rules import midpoint
from discmech.studies.core.fitting import batch_line, fit_line
from tests.studies.cached_results import measured, result


def wandering(t):
    """The mean goes from one side of the band to the other, and both of its edges stand."""
    return 1e-3 * (1 - 2 * np.abs(np.sin(3 * t)) ** (0.3 + 3 * t / t[-1]))


@pytest.mark.parametrize(("series", "verdict"), [
    (wandering, "pass"),
    (lambda t: wandering(t) + 1e-5 * t, "fail"),
    (lambda t: 1e-3 * np.sin(3 * t), "pass"),
    (lambda t: 1e-3 * np.sin(3 * t) ** 2, "pass"),  # off centre, but steady
    (lambda t: 1e-6 * t, "fail"),
    (lambda t: -1e-6 * t, "fail"),
    (lambda t: 1e-3 * np.sin(3 * t) + 1e-5 * t, "fail"),
    (lambda t: 1e-3 * np.sin(3 * t) + 1e-8 * t, "pass"),
    (lambda t: np.expm1(-t / 50), "fail"),
    (lambda t: 0 * t, "pass"),
    (lambda t: 1e-15 * t / t[-1], "pass"),  # a slope within round-off
    (lambda t: 40 * np.sin(3 * t), "inconclusive"),  # another motion's, though it has a band
    (lambda t: np.where(t > 90, np.nan, 1e-3 * np.sin(3 * t)), "fail"),
    (lambda t: np.where(t > 90, np.inf, 1e-3 * np.sin(3 * t)), "fail"),
])  # fmt: skip
def test_energy_that_drifts_fails_and_energy_that_oscillates_passes(monkeypatch, series, verdict):
    def errors(scheme, run, digits=16):
        with np.errstate(all="ignore"):
            return series(np.asarray(run.t, dtype=float))

    monkeypatch.setattr("discmech.studies.systems.scene_system.energy_errors", errors)
    monkeypatch.setattr("discmech.studies.energy.modified.measured", lambda *_: [])
    with np.errstate(all="ignore"):
        found = measured("energy", "harmonic", midpoint, 16, 1000)
    assert found["verdict"] == verdict, found["reason"]
    assert bool(found["reason"]) is (verdict != "pass")


def test_a_part_of_a_band_is_no_drift_though_it_has_a_slope():
    """Over one period a sound method has a slope, and an interval of it that holds 0."""
    found = result("energy", "pendulum", "midpoint", 16, 64)
    low, high = found["measured"]["slope_interval"]
    assert found["verdict"] == "pass" and low < 0 < high


@pytest.mark.dear("[energy")
@pytest.mark.parametrize(
    ("study", "said"), [("order", "the runs do not converge"), ("energy", "100% of its band")]
)
def test_an_update_that_loses_a_thousandth_a_step_fails_in_order_and_energy(
    wrong_gain, monkeypatch, study, said
):
    def gain(self):
        wrong = self.plus * sympy.Rational(999, 1000) - self.minus
        return self._per_step(self.of.graph.column(wrong))

    monkeypatch.setattr(Arrows, "gain_of_rows", property(gain))
    found = measured(study, scenes.get("pendulum").with_values(), midpoint, 50)
    assert found["verdict"] == "fail" and said in found["reason"]


@pytest.mark.slow
def test_neighbours_that_follow_one_another_promise_no_slope():
    """A slow wander is as good as a few points: its 95 % interval holds the slope 0 that it has."""
    t, held = np.arange(20_000.0), {"points": 0, "batches": 0}
    for seed in range(40):
        steps = np.random.default_rng(seed).normal(size=len(t))
        wander = np.array([*accumulate(steps, lambda past, step: 0.999 * past + step)])
        for name, line in (("points", fit_line(t, wander)), ("batches", batch_line(t, wander))):
            held[name] += line.interval[0] <= 0 <= line.interval[1]
    assert held["points"] <= 10 and held["batches"] >= 28


@pytest.mark.slow
@pytest.mark.parametrize("steps", [2000, 10000])
def test_an_error_that_grows_exponentially_has_no_band(steps):
    """Just beyond the limit hω = 2 of Störmer and Verlet all growth is in the last rows, and a line
    through all of them is flat."""
    stiff = Scene("stiff", pair(1), lambda x, v, p: (v[0] ** 2 - 4 * x[0] ** 2) / 2, x0=[1], v0=[0],
                  step="1.0001", duration=100)  # fmt: skip
    found = measured("energy", stiff, "trapezoidal", 16, steps)
    assert found["verdict"] == "fail" and "it grows" in found["reason"]


@one_step(order=1, implicit=True)
def implicit_euler(s, z, Z, h):
    return Z - z - h * s.f(Z)


@one_step(order=1)
def explicit_euler(s, z, h):
    return z + h * s.f(z)


@pytest.mark.dear("[20000-", "[1000000-")
@pytest.mark.parametrize("scene", [
    "harmonic", *(pytest.param(name, marks=pytest.mark.slow)
                  for name in ("pendulum", "henon-heiles", "spherical-pendulum")),
])  # fmt: skip
@pytest.mark.parametrize("steps", [20_000, 200_000, 1_000_000])
def test_a_method_that_takes_the_energy_at_once_and_rests_fails(scene, steps):
    """A line through a long rest is flat, however much was lost before it."""
    found = measured("energy", scene, implicit_euler, 16, steps)
    assert found["verdict"] == "fail", found["reason"]
    assert steps == 20_000 or "comes to rest" in found["reason"]


@pytest.mark.slow
def test_an_error_that_is_made_for_good_is_no_band():
    """A planet that spirals out, and a flight away from a repelling centre, move on."""
    spiral = measured("energy", "kepler", explicit_euler, 16, 1_000_000)
    away = Scene("away", pair(1), lambda x, v, p: v[0] ** 2 / 2 - 1 / x[0], x0=["0.1"], v0=[0],
                 step="0.05", duration=10)  # fmt: skip
    flight = measured("energy", away, "trapezoidal", 16, 20_000)
    for found in (spiral, flight):
        assert found["verdict"] == "inconclusive" and "no band" in found["reason"]
    calm = measured("energy", away.with_values(step="0.001"), "trapezoidal", 16, 20_000)
    assert calm["verdict"] == "pass", calm["reason"]
