"""Steps that are not consistent pass no study, also none that a rule of any order passes."""

import importlib.util
from pathlib import Path

import pytest

from discmech import midpoint, scenes
from discmech.studies import get
from discmech.studies.core.case import Case, Choice, Measurement, Verdict
from discmech.studies.core.outcome import NOT_CONSISTENT
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
CASES = [
    ("symplecticity", "pendulum", of_order.heavy, 24), ("energy", "pendulum", of_form.nothing, 500),
    ("momentum", "spherical-pendulum", of_order.heavy, 200),
]  # fmt: skip


@pytest.mark.dear("[energy-pendulum", "200]")
@pytest.mark.parametrize(("study", "scene", "rule", "steps"), CASES)
def test_what_is_not_consistent_passes_nowhere(study, scene, rule, steps):
    case = measured(study, scene, rule, 16, steps)

    assert case["verdict"] == "fail" and case["why"] == NOT_CONSISTENT
    assert "from an exact state (" in case["reason"] and ", seed " in case["reason"]


def test_a_sound_step_leaves_the_verdict():
    told = Verdict("pass", "", {})
    case = Case("energy", scenes.get("pendulum"), midpoint, 16)

    assert single_steps(case).order == pytest.approx(2, abs=0.01)
    assert demand_consistency(Measurement.of({"local": single_steps(case)}), told) is told


@pytest.mark.parametrize("found", [
    {}, {"local": None}, {"local": {"order": None, "unknown": "no places"}},
])  # fmt: skip
def test_where_nothing_is_known_the_run_is_judged(found):
    told = Verdict("pass", "", {})

    assert demand_consistency(found, told) is told


def test_controls_are_asked_for_no_consistency():
    found = get("symplecticity").measuring.cases(Choice(own=(("control", ("damped",)),)))

    assert found and all(single_steps(case) is None for case in found)


def test_nothing_passes_where_the_rule_makes_no_single_step():
    refused = {"order": None, "unknown": "its numbers are not finite.", "refused": True}

    for verdict, wanted in (("pass", "inconclusive"), ("fail", "fail")):
        told = demand_consistency({"local": refused}, Verdict(verdict, "", {}))
        assert told.verdict == wanted
