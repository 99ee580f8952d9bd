"""Stability: intervals known by hand, classes decided as they say, wrong methods found out."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from discmech.integrators import discretisation, imex, midpoint, scenes, trapezoidal
from discmech.integrators import rules as discretisations
from discmech.studies import get
from discmech.studies.core import controls
from discmech.studies.core.case import Choice, scheme_of
from discmech.studies.core.running import run_case, run_study
from discmech.studies.stability import exchange, plot_maps
from discmech.studies.stability.linear_stability import (
    Oscillator,
    Spectrum,
    off_circle,
    resonances,
    spectra,
    unstable_intervals,
)
from discmech.studies.stability.nonlinear_stability import (
    CLASSES,
    RETURNS,
    limits,
    one_run,
    resonant,
    stability_map,
)
from discmech.studies.stability.stiff import FAMILIES
from tests.studies.cached_results import SMALL, case, measured_once

# -- linear ---------------------------------------------------------------------------------------


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


@pytest.mark.parametrize("rule", [midpoint, imex])
def test_midpoint_has_no_end(rule):
    """tr M = 2 (1 − z²/4)/(1 + z²/4)."""
    problem = Oscillator(rule)
    assert unstable_intervals(problem.matrix) == [] and not problem.grows(1000.0)
    assert resonances(problem.matrix)["1:4"] == pytest.approx(2, abs=1e-12)


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


@pytest.mark.parametrize("name", [
    "explicit Euler",
    pytest.param("classical Runge-Kutta", marks=pytest.mark.slow),
    pytest.param("Heun", marks=pytest.mark.slow),
])  # fmt: skip
def test_what_is_not_symplectic_leaves_the_circle(name):
    problem = Oscillator(controls.RUNGE_KUTTA[name])
    assert off_circle(spectra(problem.matrix), 1.0) is not None
    found = run_case(get("stability"), case("stability", "harmonic", "midpoint", control=name))
    assert found["verdict"] == "pass" and found["control"]


def test_a_symplectic_rule_in_the_place_of_a_control_is_missed(monkeypatch):
    monkeypatch.setitem(controls.RUNGE_KUTTA, "explicit Euler", trapezoidal)
    found = run_case(
        get("stability"), case("stability", "harmonic", "midpoint", control="explicit Euler")
    )
    assert found["verdict"] == "fail" and "not caught" in found["reason"]


def test_an_interval_that_runs_contradict_fails(monkeypatch):
    monkeypatch.setattr(
        "discmech.studies.stability.linear_stability.unstable_intervals",
        lambda step: [(1.5, 1000.0)],
    )
    found = run_case(get("stability"), case("stability", "harmonic", "trapezoidal"))
    assert found["verdict"] == "fail" and "contradict" in found["reason"]


# -- classes --------------------------------------------------------------------------------------


def made_up(energies, cause="", far_from_home=0.0):
    """What `one_run` says of a run with these energies."""
    errors = np.asarray(energies, dtype=float)
    x = 1 + np.arange(len(errors))[:, None] * far_from_home / max(1, len(errors))
    run = SimpleNamespace(t=np.arange(len(errors)), x=x, steps=len(errors) - 1)
    measures = {"energy": lambda found: (1 + errors[:, None], np.ones((len(errors), 1)))}

    def runner(scheme, step, steps):
        if cause:
            from discmech.integrators import StepFailure

            raise StepFailure("s", "r", 1, 0.1, {"x": [0.0]}, cause, run)
        return run

    return one_run(None, Fraction(1, 10), 100, measures, runner, 10.0)["class"]


T = np.linspace(0, 1, 500)


def test_every_class_by_its_criterion():
    assert made_up(0.1 * np.sin(90 * T)) == "bounded"
    assert made_up(0.1 * T) == "drifting"
    assert made_up(0.005 * T) == "bounded"  # an exchange of a hundredth is no drift
    assert made_up(np.exp(9 * T) / 1000) == "blown up"
    assert made_up([0.0, math.nan, 0.0]) == "blown up"
    assert made_up(0 * T, "Newton did not converge") == "Newton failed"
    assert made_up(0 * T, "FL is singular or the numbers are no longer finite") == "blown up"
    assert made_up(0.01 * np.sin(90 * T), far_from_home=8.0) == "bounded"
    assert made_up(0.01 * np.sin(90 * T), far_from_home=12.0) == "escaped"
    assert made_up([], "Newton did not converge") == "Newton failed"


def test_a_shift_that_a_longer_run_takes_back_is_no_drift():
    energies = {100: 0.1 * np.cos(0.5 * np.pi * T), 800: 0.1 * np.cos(4 * np.pi * T)}

    def runner(scheme, step, steps):
        return SimpleNamespace(t=T, steps=steps)

    def terms(found):
        return 1 + energies[found.steps][:, None], np.ones((len(T), 1))

    told = one_run(None, Fraction(1, 10), 100, {"energy": terms}, runner)
    assert (told["class"], told["steps"]) == ("bounded", 800)


def test_a_peak_among_its_neighbours_is_resonant():
    def cell(band, kind="bounded"):
        return {"class": kind, "band": band}

    column = [cell(1e-3), cell(5e-3), cell(1.1e-3), cell(2e-3), cell(None, "blown up")]
    resonant(column)
    assert [row["class"] for row in column] == [
        "bounded", "resonant", "bounded", "bounded", "blown up",
    ]  # fmt: skip


def test_the_limit_is_where_the_first_run_is_not_bounded():
    rows = [{"stiffness": 2.0, "z": z, "class": c}
            for z, c in ((0.1, "bounded"), (0.2, "resonant"), (0.3, "bounded"))]  # fmt: skip
    assert limits(rows) == {"2": 0.1}
    assert limits([{"stiffness": 3.0, "z": 0.1, "class": "blown up"}]) == {"3": 0.0}


def test_every_class_has_a_look_and_a_criterion():
    assert set(plot_maps.LOOKS) == set(CLASSES)


# -- maps -----------------------------------------------------------------------------------------


def test_fpu_ends_where_the_linear_theory_says_for_trapezoidal_and_not_for_imex():
    rows = {
        rule.name: stability_map(FAMILIES["fpu"], scheme_of(scenes.get("fpu"), rule), steps=2000)
        for rule in (trapezoidal, imex)
    }
    for row in rows["trapezoidal"]:
        assert (row["class"] == "bounded") is (row["z"] < 1.9) or 1.5 < row["z"] < 2
    stiff = [row for row in rows["imex"] if row["stiffness"] >= 500]
    assert {row["class"] for row in stiff} == {"bounded"}


def test_imex_blows_up_at_ten_fast_radians_and_a_frequency_of_fifty():
    """Chaos and rounding decide the moment, T = 4000 to 23000 from 21 nearby starts, about 10⁴ in
    the mean: within the T = 60000 of the map but for one in hundreds."""
    scheme = FAMILIES["fpu"].scheme(scheme_of(scenes.get("fpu"), imex), Fraction(50))
    rows = [r for r in stability_map(FAMILIES["fpu"], scheme) if r["stiffness"] == 50]
    (cell,) = [row for row in rows if row["z"] == pytest.approx(10)]
    assert cell["class"] == "blown up" and 0 < cell["time"] <= 60_000


OFTEN = ("fpu", "kepler", "rigid-body")
EVERY = [pytest.param(n, marks=() if n in OFTEN else pytest.mark.slow) for n in FAMILIES]


@pytest.mark.parametrize("name", EVERY)
def test_every_family_has_variants_that_run(name):
    family, scheme = FAMILIES[name], scheme_of(scenes.get(name), midpoint)
    assert family.scene == name and list(family.stiffness) == sorted(family.stiffness)
    for value in family.stiffness:
        step = Fraction(0.1 / family.frequency(value))
        run = family.scheme(scheme, value).flow(step).trajectory(20)
        assert np.isfinite(run.mu).all()


def test_explicit_euler_has_no_bounded_run():
    found = run_case(
        get("stability"), case("stability", "spring-pendulum", "midpoint", control="explicit Euler")
    )
    assert found["verdict"] == "pass" and set(found["measured"]["classes"]) <= {
        "blown up", "drifting",
    }  # fmt: skip


def test_a_rule_that_is_lost_at_small_steps_fails(monkeypatch):
    def lost(family, derived, *arguments, **more):
        return [{"stiffness": 0.9, "z": 0.3, "class": "drifting"}]

    monkeypatch.setattr("discmech.studies.stability.measuring.stability_map", lost)
    found = run_case(get("stability"), case("stability", "kepler", "midpoint"))
    assert found["verdict"] == "fail" and "drifting at hω = 0.3 and e = 0.9" in found["reason"]


@pytest.mark.parametrize("kind", ["escaped", "resonant", "blown up"])
@pytest.mark.parametrize(("e", "near"), [(0.6, False), (0.9, True)])
def test_an_escape_fails_where_the_energy_forbids_it(monkeypatch, e, near, kind):
    """The energy is 1/9 of its terms at e = 0.6, and 1/39 at 0.9: (hω)² is 1/11."""
    verdict = "pass" if near and kind != "blown up" else "fail"

    def lost(family, derived, *arguments, **more):
        return [{"stiffness": e, "z": 0.3, "class": kind}]

    monkeypatch.setattr("discmech.studies.stability.measuring.stability_map", lost)
    assert run_case(get("stability"), case("stability", "kepler", "midpoint"))["verdict"] == verdict


def test_a_comet_that_is_flung_out_is_no_bounded_run():
    """At hω = 1 and e = 0.6 Störmer–Verlet leaves to a hundred times the orbit, its energy error a
    tenth of the energy's terms; at hω = 0.1 it returns to the pericentre at every eccentricity."""
    family, scheme = FAMILIES["kepler"], scheme_of(scenes.get("kepler"), trapezoidal)
    rows = stability_map(replace(family, stiffness=family.stiffness[:1]), scheme)
    kinds = {round(row["z"], 3): row["class"] for row in rows}
    assert kinds[0.1] == "bounded" and kinds[1.0] == "escaped" and kinds[10.0] == "blown up"


def test_a_run_covers_the_slow_motion():
    family, scheme = FAMILIES["kepler"], scheme_of(scenes.get("kepler"), midpoint)
    times = []

    def run(scheme, step, steps):
        times.append(float(step * steps))
        return scheme.flow(step).trajectory(1)

    stability_map(replace(family, stiffness=family.stiffness[-1:]), scheme, run=run)
    assert min(times) >= RETURNS * 2 * math.pi


# -- exchange -------------------------------------------------------------------------------------


def test_the_exchange_of_energy_comes_out_right_by_imex_and_wrong_by_midpoint():
    certain = exchange.reference()[1]
    assert certain < 1e-6
    errors = {
        rule.name: {row["z"]: row["error"] for row in
                    exchange.exchange_errors(scheme_of(scenes.get("fpu"), rule))}
        for rule in (imex, midpoint)
    }  # fmt: skip
    assert errors["imex"][5.0] < exchange.RIGHT < 0.5 < errors["midpoint"][5.0]
    assert errors["imex"][0.1] < 0.01


def test_the_reference_of_the_exchange_is_that_of_small_steps():
    """Störmer–Verlet at hω = 1/100 and 1/200, extrapolated in h²."""
    scheme = FAMILIES["fpu"].scheme(scheme_of(scenes.get("fpu"), trapezoidal), exchange.OMEGA)
    a, b = (exchange.slow_energies(scheme, exchange.OMEGA, Fraction(1, k))[0] for k in (100, 200))
    left = np.abs((4 * b - a) / 3 - exchange.reference()[0]).max()
    assert left < np.abs(b - a).max() / 50 < 1e-6


def test_stiffer_springs_hand_their_energy_on_rightly_by_imex_alone():
    """hω = 5; by Störmer–Verlet nothing comes to an end there."""
    errors = {
        rule.name: exchange.exchange_errors(
            scheme_of(scenes.get("fpu"), rule), Fraction(200), [exchange.COARSE]
        )[0]
        for rule in (imex, midpoint, trapezoidal)
    }
    assert errors["imex"]["error"] < 0.2 < 0.7 < errors["midpoint"]["error"]
    assert errors["trapezoidal"]["error"] is None and errors["trapezoidal"]["cause"]


@pytest.mark.parametrize(("error", "words"), [(0.2, "is wrong by 20 %"), (None, "not followed")])
def test_an_exchange_that_is_wrong_where_it_is_resolved_fails(error, words):
    told = {"kind": "map", "rows": [], "label": "ω", "measured": {"exchange": {"0.1": error}}}
    verdict = get("stability").judge(case("stability", "fpu", "midpoint"), told)
    assert verdict.verdict == "fail" and words in verdict.reason
    told["measured"]["exchange"]["0.1"] = 0.09
    assert get("stability").judge(case("stability", "fpu", "midpoint"), told).verdict == "pass"


@pytest.mark.slow
def test_the_adiabatic_invariant_over_a_hundred_thousand():
    rows = {r["omega"]: r for r in exchange.adiabatic(scheme_of(scenes.get("fpu"), imex))}
    assert rows[50.0]["change"] is None and "no longer finite" in rows[50.0]["cause"]
    assert all(rows[w]["change"] < 0.15 for w in rows if w >= 100)


def test_the_study_as_it_is_asked():
    scene, steps = SMALL["stability"]
    choice = Choice(scenes=(scenes.get(scene),), rules=(midpoint, imex), digits=(16,), steps=steps)
    with measured_once():
        found = run_study(get("stability"), choice)
    assert [c["rule"] for c in found["cases"]] == ["midpoint", "imex"]
    assert found["verdict"] == "pass"
    assert get("stability").cases(Choice(scenes=(scenes.get("pendulum"),))) == []
