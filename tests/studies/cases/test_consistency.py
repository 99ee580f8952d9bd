"""Steps that are not consistent pass no study, also none that a rule of any order passes."""

import importlib.util
from pathlib import Path

import pytest

from discmech import midpoint, scenes
from discmech.studies import get
from discmech.studies.core.case import Case, Choice, Measurement, Verdict
from discmech.studies.core.outcome import KEPT_ELSEWHERE, NOT_CONSISTENT
from discmech.studies.evidence.judging import demand_consistency
from discmech.studies.evidence.measuring import single_steps
from tests.studies.cached_results import measured

ATTACKS = Path(__file__).parents[3] / "docs" / "attacks"


def _loaded(name):
    spec = importlib.util.spec_from_file_location(name, ATTACKS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


of_form, of_order = _loaded("form"), _loaded("order")
KEPT = {
    "symplecticity": "the form is kept", "energy": "the energy keeps its law",
    "momentum": "every momentum keeps its law",
}  # fmt: skip
CASES = [
    ("symplecticity", "pendulum", of_order.heavy, 24), ("energy", "pendulum", of_form.nothing, 500),
    ("momentum", "spherical-pendulum", of_order.heavy, 200),
]  # fmt: skip


@pytest.mark.dear("[energy-pendulum", "200]")
@pytest.mark.parametrize(("study", "scene", "rule", "steps"), CASES)
def test_what_is_not_consistent_passes_nowhere(study, scene, rule, steps):
    case = measured(study, scene, rule, 16, steps)

    assert case["verdict"] == "fail" and case["why"] == KEPT_ELSEWHERE
    assert case["reason"].startswith(f"{KEPT[study]}, but by another motion than the scene's")
    assert "from an exact state (" in case["reason"] and ", seed " in case["reason"]


def test_a_sound_step_leaves_the_verdict():
    told = Verdict("pass", "", {})
    case = Case("energy", scenes.get("pendulum"), midpoint, 16)

    assert single_steps(case).order == pytest.approx(2, abs=0.01)
    assert demand_consistency(Measurement.of({"local": single_steps(case)}), told) == told


def test_a_law_that_no_run_showed_is_not_said_to_be_kept():
    local = {"order": 0.0, "component": "mu[0]"}

    for verdict, expected in (("pass", {"not_demanded": "a force"}), ("inconclusive", {})):
        told = Verdict(verdict, "", expected)
        found = demand_consistency({"local": local}, told, kept=KEPT["symplecticity"])
        assert found.why == NOT_CONSISTENT and KEPT["symplecticity"] not in found.reason


@pytest.mark.parametrize("found", [
    {}, {"local": None}, {"local": {"order": None, "unknown": "no places"}},
])  # fmt: skip
def test_where_nothing_is_known_the_run_is_judged(found):
    told = Verdict("pass", "", {})

    assert demand_consistency(found, told) == told


def test_controls_are_asked_for_no_consistency():
    found = get("symplecticity").measuring.cases(Choice(own=(("control", ("damped residual",)),)))

    assert found and all(single_steps(case) is None for case in found)


def test_nothing_passes_where_the_rule_makes_no_single_step():
    refused = {"order": None, "unknown": "its numbers are not finite.", "refused": True}

    for verdict, wanted in (("pass", "inconclusive"), ("fail", "fail")):
        told = demand_consistency({"local": refused}, Verdict(verdict, "", {}))
        assert told.verdict == wanted
