"""Stability: intervals known by hand, classes decided as they say, wrong methods found out."""

import math
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import pytest

from discmech.integrators import (
    Scene,
    Scheme,
    StepFailure,
    imex,
    midpoint,
    pair,
    scenes,
    trapezoidal,
)
from discmech.integrators import rules as discretisations
from discmech.studies import get
from discmech.studies.core.case import Choice, scheme_of
from discmech.studies.core.outcome import Measurement
from discmech.studies.core.result import result_of
from discmech.studies.report import tables
from discmech.studies.report.canvas import figure_of
from discmech.studies.stability import nonlinear_stability, own_scene, plot_maps, view
from discmech.studies.stability.judging import judge
from discmech.studies.stability.nonlinear_stability import limits, one_run, resonant, stability_map
from discmech.studies.stability.records import Cell, Found, Measured, Row
from discmech.studies.stability.stiff import FAMILIES
from tests.studies.as_json import run_study
from tests.studies.cached_results import SMALL, measured, measured_once


def made_up(energies, cause="", far_from_home=0.0):
    """What `one_run` says of a run with these energies."""
    errors = np.asarray(energies, dtype=float)
    x = 1 + np.arange(len(errors))[:, None] * far_from_home / max(1, len(errors))
    run = SimpleNamespace(t=np.arange(len(errors)), x=x, steps=len(errors) - 1)
    measures = {"energy": lambda found: (1 + errors[:, None], np.ones((len(errors), 1)))}

    def runner(scheme, step, steps):
        if cause:
            raise StepFailure("s", "r", 1, 0.1, {"x": [0.0]}, cause, run)
        return run

    with patch.object(nonlinear_stability, "trajectory", runner):
        return one_run(None, Fraction(1, 10), 100, measures, 10.0).outcome


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


def test_a_shift_that_a_longer_run_takes_back_is_no_drift(monkeypatch):
    energies = {100: 0.1 * np.cos(0.5 * np.pi * T), 800: 0.1 * np.cos(4 * np.pi * T)}

    def runner(scheme, step, steps):
        return SimpleNamespace(t=T, steps=steps)

    def terms(found):
        return 1 + energies[found.steps][:, None], np.ones((len(T), 1))

    monkeypatch.setattr(nonlinear_stability, "trajectory", runner)
    told = one_run(None, Fraction(1, 10), 100, {"energy": terms})
    assert (told.outcome, told.steps) == ("bounded", 800)


@pytest.mark.parametrize(("bands", "peaks"), [
    ((1e-3, 5e-3, 1.1e-3, 2e-3, None), [1]),
    ((1e-3, 4e-3, 1e-3), []), ((1e-3, 4.1e-3, 1e-3), [1]),
    ((2e-3, 5e-3, 1e-3), []),  # it may have begun at the shorter step
    ((5e-3, 1e-3, 2e-3), [0]), ((4e-3, 1e-3), []), ((9e-11, 1e-12), []),
    ((None, 5e-3, 1e-3), []), ((1e-3, 5e-3, None), []), ((1e-3, 5e-3), []),
])  # fmt: skip
def test_a_peak_among_its_neighbours_is_resonant(bands, peaks):
    def found(bands, *apart):
        column = [Cell(outcome="blown up" if b is None else "bounded", band=b) for b in bands]
        found = resonant(column, *apart)
        return [i for i, cell in enumerate(found) if cell.outcome == "resonant"]

    assert found(bands) == peaks
    twice = [b for b in bands for _ in range(2)]
    assert found(twice, 2) == [i for i, b in enumerate(twice) if i // 2 in peaks]


def test_the_limit_is_where_the_first_run_is_not_bounded():
    rows = [Cell(2.0, z, outcome=c)
            for z, c in ((0.1, "bounded"), (0.2, "resonant"), (0.3, "bounded"))]  # fmt: skip
    assert limits(rows) == {"2": 0.1}
    stiffer = [Cell(3.0, 0.1, outcome="blown up")]
    assert limits(stiffer) == {"3": 0.0} and limits(rows + stiffer) == {"2": 0.1, "3": 0.0}


@pytest.mark.slow
def test_fpu_ends_where_the_linear_theory_says_for_trapezoidal_and_not_for_imex():
    rows = {
        rule.name: stability_map(FAMILIES["fpu"], scheme_of(scenes.get("fpu"), rule), steps=2000)
        for rule in (trapezoidal, imex)
    }
    for row in rows["trapezoidal"]:
        assert (row.outcome == "bounded") is (row.z < 1.9) or 1.5 < row.z < 2
    stiff = [row for row in rows["imex"] if row.stiffness >= 500]
    assert {row.outcome for row in stiff} == {"bounded"}


def test_imex_blows_up_at_ten_fast_radians_and_a_frequency_of_fifty():
    """Chaos and rounding decide the moment, T = 4000 to 23000 from 21 nearby starts, about 10⁴ in
    the mean: within the T = 60000 of the map but for one in hundreds."""
    scheme = FAMILIES["fpu"].scheme(scheme_of(scenes.get("fpu"), imex), Fraction(50))
    rows = [r for r in stability_map(FAMILIES["fpu"], scheme) if r.stiffness == 50]
    (cell,) = [row for row in rows if row.z == pytest.approx(10)]
    assert cell.outcome == "blown up" and 0 < cell.time <= 60_000


@pytest.mark.dear("kepler-gauss-3")
@pytest.mark.parametrize(("name", "rule"), [("kepler", "suzuki:trapezoidal"), ("kepler", "gauss-3"),
                                            ("rigid-body", "midpoint")])  # fmt: skip
def test_a_map_is_the_same_on_all_cores(monkeypatch, name, rule):
    family = replace(FAMILIES[name], stiffness=FAMILIES[name].stiffness[-1:])
    scheme, maps = scheme_of(scenes.get(name), discretisations.get(rule)), []
    for cores in (1, 3):
        monkeypatch.setattr("discmech.integrators.runs.ensemble.cores", lambda n=cores: n)
        maps.append(stability_map(family, scheme, steps=500))
    assert maps[0] == maps[1]


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
    found = measured("stability", "spring-pendulum", "explicit-euler", control="explicit Euler")
    assert found["verdict"] == "pass"
    assert set(found["measured"]["classes"]) <= {"blown up", "drifting"}


def test_a_comet_that_is_flung_out_is_no_bounded_run():
    """At hω = 1 and e = 0.6 Störmer–Verlet leaves to a hundred times the orbit, its energy error a
    tenth of the energy's terms; at hω = 0.1 it returns to the pericentre at every eccentricity."""
    family, scheme = FAMILIES["kepler"], scheme_of(scenes.get("kepler"), trapezoidal)
    rows = stability_map(replace(family, stiffness=family.stiffness[:1]), scheme)
    kinds = {round(row.z, 3): row.outcome for row in rows}
    assert kinds[0.1] == "bounded" and kinds[1.0] == "escaped" and kinds[10.0] == "blown up"


def test_a_run_covers_the_slow_motion(monkeypatch):
    family, scheme = FAMILIES["kepler"], scheme_of(scenes.get("kepler"), midpoint)
    times = []

    def run(scheme, step, steps):
        times.append(float(step * steps))
        return scheme.flow(step).trajectory(1)

    monkeypatch.setattr(nonlinear_stability, "trajectory", run)
    stability_map(replace(family, stiffness=family.stiffness[-1:]), scheme)
    assert min(times) >= 6 * math.pi


@pytest.mark.slow
def test_the_study_as_it_is_asked():
    scene, steps = SMALL["stability"]
    choice = Choice(scenes=(scenes.get(scene),), rules=(midpoint, imex), digits=(16,), steps=steps)
    with measured_once():
        found = run_study(get("stability"), choice)
    assert [c["rule"] for c in found["cases"]] == ["midpoint", "imex"]
    assert found["verdict"] == "pass"
    assert get("stability").cases(Choice(scenes=(scenes.get("cartesian-pendulum"),))) == []


@pytest.mark.slow
@pytest.mark.parametrize("start", ["1.5", 2, 6])
def test_midpoint_is_stable_at_rest_wherever_that_is(start):
    """At 2π, too, where a step from rest changes nothing but round-off."""
    pendulum = scenes.get("pendulum").with_values(x0=[start], v0=[0])
    at = own_scene.equilibrium(pendulum)
    assert abs(at.z[0] - (2 * math.pi if start == 6 else 0)) < 1e-9
    found = own_scene.Linearised(Scheme(pendulum, midpoint), at).measured()
    assert found["stable_to"] is None and found["runs"] and found["off_circle"] is None


def test_a_scene_of_ones_own_is_linearised_at_an_equilibrium():
    """At the bottom of a well, and of a body about its axis, whose frequency is Euler's."""
    well = Scene(
        name="well", groupoid=pair(1), x0=["1.2"], v0=[0], duration=10,
        lagrangian=lambda x, v, p: v[0] ** 2 + x[0] ** 2 / 2 - x[0] ** 4 / 4,
    )  # fmt: skip
    at = own_scene.equilibrium(well)
    assert not at.given and abs(at.z[0] - 1) < 1e-9 and abs(at.frequency - 1) < 1e-6
    found = own_scene.Linearised(Scheme(well, trapezoidal), at).measured()
    assert abs(found["stable_to"] - 2) < 1e-5 and found["runs"] and found["off_circle"] is None
    hanging = scenes.get("spherical-pendulum")  # whose start must have μ·x = 0, to the last digit
    at = own_scene.equilibrium(hanging)
    radius = own_scene.Linearised(Scheme(hanging, midpoint), at).radius(1.5)
    assert not at.turns and abs(radius - 1) < 1e-9
    spin = own_scene.equilibrium(scenes.get("rigid-body"))
    assert spin.turns
    ratio = spin.frequency / np.linalg.norm(spin.z)
    assert min(abs(ratio - 1 / 3), abs(ratio - 3**-0.5)) < 1e-6
    measured = {"classes": {"bounded": 1}, "equilibrium": [1.5, 3e-17], "frequency": 2.0}
    shown = view.VIEW.got(result_of("stability", {"measured": measured}))
    assert "(x, μ) = (1.5, 0), ω = 2" in shown


def test_what_a_steady_turn_or_a_chaotic_run_meets_is_not_failed():
    """An eigenvalue off the circle fails at rest alone, and Newton's failure on a stiff family."""
    top = scenes.get("heavy-top").with_values(name="kepler")  # by its name alone of a family
    (of,) = get("stability").cases(Choice((top,), (midpoint,)))
    away = {"stable_to": 0.1, "runs": True}
    row = Row(z=0.3, stiffness=1.0, outcome="Newton failed")
    for numbers, rows, verdict in (
        (away, [], "fail"), (away | {"turns": True}, [], "inconclusive"),
        ({"frequency": 1.0, "fastest": 1.0}, [row], "inconclusive"),
        ({"frequency": 1.0, "fastest": 1.0}, [replace(row, outcome="blown up")], "fail"),
    ):  # fmt: skip
        found = Found("map", "amplitude", rows, Measured(**numbers))
        assert judge(of, Measurement.of(found)).verdict == verdict


def test_a_map_of_one_amplitude_is_a_bar_a_rule():
    """One panel with a line a rule, no taller than it is; a map of a family is one a rule."""

    def case(rule, *stiff):
        rows = [{"z": z, "stiffness": k, "class": "bounded"} for k in stiff for z in (0.1, 1.0)]
        return result_of(
            "stability",
            {
                "kind": "map",
                "scene": "mine",
                "rule": rule,
                "rows": rows,
                "label": "amplitude",
                "measured": {"classes": {"bounded": 2}},
            },
        )

    (alone,), wide = plot_maps.with_legend(*plot_maps.map_table([case("a", 1)], {}), [case("a", 1)])
    (only,) = figure_of([alone], wide).axes  # no cell is left half empty
    assert [text.get_text() for text in only.child_axes[0].texts] == ["bounded"]
    panels, sheet = plot_maps.map_table([case("a", 1), case("b", 1)], {})
    (panel,) = panels
    (axes,) = figure_of(panels, sheet).axes
    assert [label.get_text() for label in axes.get_yticklabels()] == ["b", "a"]
    assert axes.bbox.height / axes.figure.dpi <= 2 * plot_maps.BAR + 0.01
    assert "amplitude" not in panel.subtitle
    assert len(plot_maps.map_table([case("a", 1, 2), case("b", 1, 2)], {})[0]) == 2


def test_a_search_without_an_end_says_where_it_ended():
    measured = {"equilibrium": [0.0], "frequency": 1.0, "stable_to": None, "classes": {}}
    told = tables.got(result_of("stability", {"kind": "map", "measured": measured}))
    assert "up to 6, where the search ended" in told
