"""A failing case is made small: the smaller one fails too, and not by every method."""

import json
import shlex
from dataclasses import replace

import pytest

from discmech.integrators import discretisation, scenes
from discmech.integrators.rules import midpoint
from discmech.studies import get
from discmech.studies.command.entry import main
from discmech.studies.core.case import Case, Verdict
from discmech.studies.core.one_case import run_case
from discmech.studies.core.outcome import STEPS_ARE_OFF
from discmech.studies.core.shrinking import LONGEST, size, smallest

SMALLER = True
LOPSIDED = """
from discmech import discretisation

@discretisation(order=2)
def lopsided(L, G, x, u, h):
    return h * L(G.target(x, u, h / 3), u)
"""


@discretisation(order=2)
def other(L, G, x, u, h):
    return h * L(x, u)


def judged(monkeypatch, fails):
    """The momentum study, replaced by a law on cases; more steps measure more."""
    study = get("momentum")

    def measure(case, progress):
        return {"measured": {"drift": {"n": case.steps or 1000}}, "rows": []}

    def judge(case, measurement):
        return Verdict("fail", "it drifts.") if fails(case) else Verdict("pass")

    monkeypatch.setattr(study.measuring, "measure", measure)
    monkeypatch.setattr(study.measuring, "measure_more", lambda *_: {})
    monkeypatch.setattr(study.judging, "judge", judge)
    monkeypatch.setattr(study.judging, "diagnose", lambda *_: None)
    return study


def made_small(study, case, seconds=50.0):  # so that tries do not end by the clock
    result = replace(run_case(study, case), seconds=seconds)
    assert result.verdict == "fail"
    return smallest(study, case, result)


@pytest.mark.slow
def test_the_command_of_the_smallest_case_fails_too(tmp_path, capsys):
    file = tmp_path / "mine.py"
    file.write_text(LOPSIDED)
    asked = ["order", "kepler", "--rule", f"{file}:lopsided", "--digits", "50", "--json", "-"]
    assert main(asked) == 1
    (case,) = json.loads(capsys.readouterr().out)["cases"]
    small = case["smallest"]
    assert size(scenes.get(small["scene"])) < size(scenes.get("kepler"))
    assert main(shlex.split(small["command"])[1:]) == 1


def test_fewest_steps_simplest_scene_and_parameters_that_do_not_matter(monkeypatch):
    def fails(case):
        long = (case.steps or 1000) >= 100
        return long and case.rule is other and case.scene.name in ("heavy-top", "lagrange-top")

    small = made_small(
        judged(monkeypatch, fails), Case("momentum", scenes.get("heavy-top"), other, 16)
    )
    simplest = min(map(scenes.get, ("heavy-top", "lagrange-top")), key=size)
    assert (small.scene, small.steps) == (simplest.name, 128)
    numbers = {k for k, v in simplest.parameters.items() if not isinstance(v, tuple)}
    assert set(small.whatever) <= numbers and small.reason == "it drifts."


def test_parameters_of_one_are_tried_together_before_they_are_named_together(monkeypatch):
    """It fails with each of them alone set to 1, and passes with both."""
    scene = scenes.get("harmonic").with_values(parameters={"mass": 2, "stiffness": 3})
    study = judged(monkeypatch, lambda case: case.rule is other and case.scene.name == "harmonic"
                   and {*case.scene.parameters.values()} != {1})  # fmt: skip
    case = Case("momentum", scene, other, 16)
    assert made_small(study, case).whatever == ["mass"]


@pytest.mark.parametrize(("seconds", "whatever"), [(50.0, ["mass"]), (LONGEST, None)])
def test_no_case_that_takes_long_is_made_again(monkeypatch, seconds, whatever):
    scene = scenes.get("harmonic").with_values(parameters={"mass": 2})
    study = judged(monkeypatch, lambda case: case.rule is other and case.scene.name == "harmonic"
                   and case.steps is None)  # fmt: skip
    small = made_small(study, Case("momentum", scene, other, 16), seconds)
    assert (small and small.whatever) == whatever


@pytest.mark.parametrize(("same", "why", "rows"), [
    (1.0, "", []),  # what was measured does not ask for the steps
    (None, STEPS_ARE_OFF, []),
    (None, "", [{"steps": 8}, {"steps": 16}]),  # runs to one time, with ever shorter steps
])  # fmt: skip
def test_a_number_of_steps_that_makes_nothing_smaller_is_not_told(monkeypatch, same, why, rows):
    study = judged(monkeypatch, lambda case: case.rule is other and case.scene.name == "harmonic")
    judge = study.judging.judge

    def measure(case, progress):
        return {"measured": {"drift": {"n": same or case.steps or 1000}}, "rows": rows}

    monkeypatch.setattr(study.measuring, "measure", measure)
    monkeypatch.setattr(study.judging, "judge", lambda *of: replace(judge(*of), why=why))
    small = made_small(study, Case("momentum", scenes.get("harmonic"), other, 16))
    assert small is None or small.steps is None


def test_what_fails_the_midpoint_rule_too_says_nothing_of_this_one(monkeypatch):
    def fails(case):
        return case.steps in (None, 1, 2) if case.rule is other else case.steps in (1, 2)

    scene = scenes.get("harmonic").with_values(parameters={"mass": 1, "stiffness": 1})
    study = judged(monkeypatch, fails)
    case = Case("momentum", scene, other, 16)
    assert made_small(study, case) is None
    assert run_case(study, Case("momentum", scene, midpoint, 16)).verdict == "pass"


@pytest.mark.slow
def test_a_smaller_case_fails_for_the_same_cause(monkeypatch):
    """heavy-top fails by the rule; what fails on smaller scenes is something else."""
    study = judged(monkeypatch, lambda case: case.rule is other)
    alike = ("heavy-top", "lagrange-top")

    def diagnose(case, measurement):
        cause = "factor" if case.scene.name in alike else "round-off"
        return {"cause": cause, "sentence": "so it is."}

    monkeypatch.setattr(study.judging, "diagnose", diagnose)
    found = made_small(study, Case("momentum", scenes.get("heavy-top"), other, 16))
    assert found.scene in alike and "Cause: factor" in found.reason


def test_what_passes_is_left_as_it_is(monkeypatch, capsys):
    judged(monkeypatch, lambda case: False)
    assert main(["momentum", "kepler", "--rule", "midpoint", "--digits", "16", "--json", "-"]) == 0
    assert "smallest" not in json.loads(capsys.readouterr().out)["cases"][0]


def test_a_program_whose_run_ends_has_no_smaller_case(tmp_path, capsys):
    """Its reason names the step; a shorter run on a simpler scene says no more."""
    file = tmp_path / "ends.py"
    file.write_text(
        "from discmech import black_box\n\n@black_box(order=2, keeps='energy band')\n"
        "def ends(q, p, h, system):\n    q = q + h / 2 * p * (1 if q[0] > -1.5 else float('nan'))\n"
        "    p = p - h * system.gradient(q, p)\n    return q + h / 2 * p, p\n"
    )
    words = ["energy", "pendulum", "--rule", str(file), "--digits", "16", "--steps", "64"]
    assert main([*words, "--json", "-"]) == 1
    (case,) = json.loads(capsys.readouterr().out)["cases"]
    assert "not finite" in case["reason"] and "smallest" not in case
