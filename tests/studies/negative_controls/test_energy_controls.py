"""Energies that drift: the study of energy must say no, and to bands that stand it must not."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from discmech.integrators import scenes
from discmech.integrators.equations.legendre_maps import LegendreMaps
from discmech.integrators.rules import midpoint
from tests.studies.cached_results import measured, result


def wandering(t):
    """The mean goes from one side of the band to the other, and both of its edges stand."""
    return 1e-3 * (1 - 2 * np.abs(np.sin(3 * t)) ** (0.3 + 3 * t / t[-1]))


@pytest.mark.parametrize(
    ("series", "verdict"),
    [
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
        (lambda t: np.where(t > 90, np.nan, 1e-3 * np.sin(3 * t)), "fail"),
        (lambda t: np.where(t > 90, np.inf, 1e-3 * np.sin(3 * t)), "fail"),
    ],
)
def test_energy_that_drifts_fails_and_energy_that_oscillates_passes(monkeypatch, series, verdict):
    def errors(scheme, run, digits=16):
        with np.errstate(all="ignore"):
            return series(np.asarray(run.t, dtype=float))

    monkeypatch.setattr("discmech.studies.energy.measuring.energy_errors", errors)
    with np.errstate(all="ignore"):
        found = measured("energy", "harmonic", midpoint, 16, 1000)
    assert found["verdict"] == verdict, found["reason"]
    assert bool(found["reason"]) is (verdict != "pass")


def test_a_run_of_one_period_is_too_short_to_tell():
    assert result("energy", "pendulum", "midpoint", 16, 64)["verdict"] != "fail"


@pytest.mark.parametrize(("study", "digits"), [("order", 50), ("energy", 50)])
def test_an_update_that_loses_a_thousandth_a_step_fails_elsewhere_too(
    wrong_gain, monkeypatch, study, digits
):
    def gain(self):
        return self.plus * sympy.Rational(999, 1000) - self.minus

    monkeypatch.setattr(LegendreMaps, "gain", property(gain))
    found = measured(study, scenes.get("pendulum").with_values(), midpoint, digits)
    assert found["verdict"] in ("fail", "inconclusive" if study == "order" else "fail")
