"""A case that cannot be measured is marked with the reason; the others go on."""

import json
import warnings

import numpy as np
import pytest

from discmech.integrators import BadInput, StepFailure, scenes
from discmech.integrators.geometry import StepNotFound
from discmech.integrators.rules import midpoint, trapezoidal
from discmech.reference import ReferenceFailure
from discmech.studies import check, get
from discmech.studies.command.entry import main
from discmech.studies.core.case import Choice
from tests.studies.as_json import run_case, run_study
from tests.studies.cached_results import case

RESULT = {"measured": {"drift": {"J": 0.0}}, "rows": [], "steps": 10}


def failing_on(monkeypatch, study, scene, error):
    """Replace the study's measurement: one scene raises, the others are fine."""

    def measure(case, progress):
        if case.scene.name == scene:
            raise error
        return RESULT

    monkeypatch.setattr(get(study).measuring, "measure", measure)


def step_failure(name):
    return StepFailure(name, "midpoint", 17, 0.34, {"x": [1.0]}, "Newton did not converge")


def verdicts(found):
    return {c["scene"]: c["verdict"] for c in found["cases"]}


def test_a_step_failure_in_the_middle_fails_that_case_and_keeps_the_rest(monkeypatch, capsys):
    failing_on(monkeypatch, "momentum", "heavy-top", step_failure("heavy-top"))
    words = ["momentum", "kepler", "heavy-top", "lagrange-top", "--rule", "midpoint"]
    assert main([*words, "--digits", "16", "--json", "-"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["verdict"] == "fail"
    assert verdicts(found) == {"kepler": "pass", "heavy-top": "fail", "lagrange-top": "pass"}
    broken = found["cases"][1]
    assert "Newton did not converge at step 17, t = 0.34" in broken["reason"]
    assert "this exception" not in broken["reason"]  # which nobody has at hand there
    assert broken["rows"] == [] and broken["measured"] == {} and broken["command"]


def test_a_reference_that_cannot_be_had_is_inconclusive(monkeypatch, capsys):
    failing_on(monkeypatch, "momentum", "kepler", ReferenceFailure("no digit of it is certain"))
    words = ["momentum", "kepler", "heavy-top", "--rule", "midpoint", "--digits", "16"]
    assert main([*words, "--json", "-"]) == 3
    found = json.loads(capsys.readouterr().out)
    assert found["verdict"] == "inconclusive"
    assert verdicts(found) == {"kepler": "inconclusive", "heavy-top": "pass"}
    assert found["cases"][0]["reason"] == "no digit of it is certain"


def test_an_error_of_ours_is_not_taken_for_a_verdict(monkeypatch):
    failing_on(monkeypatch, "momentum", "kepler", KeyError("a bug"))
    with pytest.raises(KeyError):
        check("momentum", ["kepler"], ["midpoint"], [16])


@pytest.mark.parametrize(
    ("study", "name", "step"),
    [("symplecticity", "pendulum", 3), ("energy", "pendulum", 3), ("momentum", "kepler", 1)],
)
def test_a_step_far_too_large_is_a_verdict_not_a_crash(study, name, step):
    """Real ones: the midpoint rule has no next position at these steps."""
    scene = scenes.get(name).with_values(step=step)
    found = run_case(get(study), case(study, scene, midpoint, 16, 20))
    assert found["verdict"] == "fail"
    assert "did not converge" in found["reason"] and "smaller step" in found["reason"]


def test_a_step_that_is_not_found_again_leaves_its_case_inconclusive(monkeypatch):
    def defect(*arguments, **more):
        raise StepNotFound("Newton did not find a step again.")

    monkeypatch.setattr("discmech.integrators.flows.flow.Flow.poisson_defect", defect)
    found = run_case(get("symplecticity"), case("symplecticity", "pendulum", midpoint, 16))
    assert found["verdict"] == "inconclusive"
    assert "did not find a step again" in found["reason"]


@pytest.mark.slow
def test_rungs_that_fail_are_left_out_by_name_and_the_finer_ones_go_on():
    scene = scenes.get("pendulum").with_values(step=3, duration=30)
    # with steps that were asked for: the usual ladder begins where the motion is resolved
    rows = run_case(get("order"), case("order", scene, midpoint, 16, 10))["rows"]
    failed = [row["why_not"] == "failed" for row in rows]
    assert failed[0] and not failed[-1]
    for row in rows:
        assert (row["error"] is None) is (row["why_not"] == "failed")
        assert row["why_not"] != "failed" or ("converge" in row["cause"] and not row["used"])


@pytest.mark.slow
def test_a_run_that_overflows_is_a_verdict_without_warnings():
    scene = scenes.get("harmonic").with_values(step=3)  # beyond the limit 2 of Störmer–Verlet
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for steps in (200, 2000):
            found = run_case(get("energy"), case("energy", scene, trapezoidal, 16, steps))
            assert found["verdict"] == "fail"


def test_a_study_that_applies_to_nothing_chosen_says_what_it_needs():
    with pytest.raises(BadInput, match=r"momentum applies to none .*pendulum.*symmetries"):
        run_study(get("momentum"), Choice(scenes=(scenes.get("pendulum"),)))


def test_progress_goes_from_nothing_to_all(monkeypatch):
    def measure(case, progress):
        progress(case.scene.name, 0.0)
        progress(case.scene.name, 1.0)
        return RESULT

    monkeypatch.setattr(get("momentum").measuring, "measure", measure)
    seen = []
    chosen = Choice(scenes=tuple(map(scenes.get, ("kepler", "heavy-top"))), digits=(16,))
    run_study(get("momentum"), chosen, lambda label, f: seen.append((label, f)))
    fractions = [f for _, f in seen]
    assert (
        fractions[0] == 0 and fractions[-1] == pytest.approx(1) and fractions == sorted(fractions)
    )
    assert {label for label, _ in seen} >= {"kepler", "heavy-top"}


@pytest.mark.parametrize(("ask", "message"), [
    (lambda: get("ordr"), "there is no study"),
    (lambda: check("power"), "say discmech power in a checkout"),
    (lambda: get(np.zeros(3)), "there is no study"),
    (lambda: check("order", ["pendulm"]), "did you mean pendulum"),
    (lambda: check("order", ["pendulum"], ["midpont"]), "did you mean midpoint"),
    (lambda: check("order", ["pendulum"], ["midpoint"], [5]), "16"),
    (lambda: check("order", []), "scenes is an empty list: leave it out for all"),
    (lambda: check("order", ["pendulum"], []), "rules is an empty list: leave it out"),
    (lambda: check("order", np.array(1.0)), r"array\(1\.\) is no scene: give one"),
])  # fmt: skip
def test_wrong_names_in_python_have_a_message(ask, message):
    with pytest.raises(BadInput, match=message):
        ask()
