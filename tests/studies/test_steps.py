"""The study of varying steps: what passes, what is caught, and what is refused."""

import json
import math

import pytest
import sympy

from discmech import StepFailure, one_step, scenes, vary
from discmech.integrators.extensions.steps import varied_scheme
from discmech.integrators.rules import get
from discmech.studies.core.case import Case, Choice
from discmech.studies.core.study import every_study
from discmech.studies.steps import extended, measuring


def half(x, mu, p):
    """σ of another shape than Kepler's own, which depends on the angle too."""
    return x.dot(x) * (2 + x[0] / sympy.sqrt(x.dot(x))) / 4


def case(way, rule="trapezoidal", sigma=half, scene="kepler", **more):
    return Case("steps", scenes.get(scene), vary(get(rule), sigma, way), 16, 2000, **more)


def told(asked):
    study = every_study()["steps"]
    found = study.measurement(asked, lambda label, share: None)
    return found["measured"], study.verdict(asked, found)


@pytest.mark.slow
def test_the_poincare_way_keeps_the_extended_form():
    measured, verdict = told(case("poincare"))
    assert verdict.verdict == "pass", verdict.reason
    assert measured["form"] < 1e-40 and measured["back"] < 1e-60
    assert measured["order"] == pytest.approx(2, abs=0.02)


@pytest.mark.slow
def test_the_reversible_way_has_no_form_and_says_so():
    measured, verdict = told(case("reversible"))
    assert verdict.verdict == "pass", verdict.reason
    assert measured["form"] is None and measured["back"] < 1e-60
    assert verdict.expected["form"].startswith("no form is kept")


@pytest.mark.slow
def test_the_naive_way_fails_as_a_rule_and_is_caught_as_the_control():
    asked = case("naive")
    measured, verdict = told(asked)
    assert verdict.verdict == "fail" and "on the way back" in verdict.reason
    assert measured["order"] == pytest.approx(2, abs=0.05)
    (control,) = measuring.cases(Choice(own=(("control", (measuring.CONTROL_NAME,)),)))
    assert told(control)[1].verdict == "pass"
    still = Case("steps", control.scene, vary(get("trapezoidal"), half, "reversible"), 16, 2000,
                 measuring.CONTROL_NAME)  # fmt: skip
    verdict = told(still)[1]
    assert verdict.verdict == "fail" and "not caught" in verdict.reason


def test_a_time_that_is_not_conjugate_to_the_energy_is_caught(monkeypatch):
    """t grows by εσ at the start of the step, of the same order for rectangle: the form sees it."""
    plain = varied_scheme.with_columns

    def wrong(system, columns, increments):
        return plain(system, columns, [e.xreplace({system.x[0]: system.x[0] * sympy.Rational(
            1000001, 1000000)}) for e in increments])  # fmt: skip

    right = case("poincare", "rectangle").scheme
    start = [sympy.Rational(2, 5), 0], [0, 2]
    assert extended.form_defect(right, "1/10", *start, "-1/2") < 1e-40
    monkeypatch.setattr(varied_scheme, "with_columns", wrong)
    varied_scheme._system.cache_clear()
    altered = type(right)(right.scene, right.rule)
    assert extended.form_defect(altered, "1/10", *start, "-1/2") > 1e-9
    varied_scheme._system.cache_clear()


@pytest.mark.slow
def test_a_rule_that_is_not_self_adjoint_is_measured_only_on_the_way_back():
    measured, verdict = told(case("reversible", "runge-kutta-4"))
    assert verdict.verdict == "pass", verdict.reason
    assert measured["back"] > 1e-20 and "not self-adjoint" in verdict.expected["back"]


@pytest.mark.slow
def test_a_map_that_claims_to_be_reversible_is_held_to_it():
    @one_step(order=2, stages=2, reversible=True)
    def heun(s, z, h, K):
        return z + h * (K[0] + K[1]) / 2, [K[0] - s.f(z), K[1] - s.f(z + h * K[0])]

    rule = vary(heun, lambda x, mu, p: 1 / (1 + x.dot(x)), "reversible")
    verdict = told(Case("steps", scenes.get("henon-heiles"), rule, 16, 200))[1]
    assert verdict.verdict == "fail" and "miss their start" in verdict.reason


def test_the_command(ask):
    found = json.loads(ask("steps", "kepler", "--rule", "reversible:midpoint", "--steps", "500",
                                "--json", "-")[1])  # fmt: skip
    (one,) = found["cases"]
    assert one["verdict"] == "pass" and one["rule"] == "reversible:midpoint"
    for words, said in (
        (("order", "kepler", "--rule", "reversible:midpoint"), "`discmech steps` judges it"),
        (("steps", "kepler", "--rule", "midpoint"), "steps vary"),
        (("steps", "pendulum", "--rule", "reversible:midpoint"), "names no sigma"),
        (("steps", "kepler", "--control", "Heun"), "no control"),
    ):
        code, _, error = ask(*words)
        assert code == 2 and said in error


@pytest.mark.parametrize("way", ["reversible", "poincare"])
def test_a_place_whose_run_fails_is_said_and_not_left_out(way, monkeypatch):
    """The largest of a number and of none was the number."""
    asked = case(way)
    study = every_study()["steps"]
    found = {"rows": [], "orders": [2.0], "energy": {}, "self_adjoint": True,
             "measured": {"order": 2.0, "back": 1e-50, "form": 1e-40}}  # fmt: skip
    assert study.verdict(asked, found).verdict == "pass"
    for more, verdict in (
        ({"lost": "no step at t = 1"}, "inconclusive"), ({"back": None, "lost": "no"}, "inconc"),
        ({"back": 1e-3, "lost": "no step at t = 1"}, "fail"),
    ):  # fmt: skip
        told = study.verdict(asked, found | {"measured": found["measured"] | more})
        assert told.verdict.startswith(verdict) and (
            verdict == "fail" or more["lost"] in told.reason
        )

    def number(case, step, x, mu):
        if mu == 2:
            raise StepFailure("s", "r", 3, 0.1, {}, "it fails")
        return mu

    monkeypatch.setattr(measuring, "_states", lambda case: [(0, k) for k in (1, 2, 3)])
    largest, lost = measuring._largest(number, asked, 1)
    assert largest == 3 and "it fails at step 3" in lost
    assert measuring._largest(lambda *given: math.nan, asked, 1) == (math.inf, None)
