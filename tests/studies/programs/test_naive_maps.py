"""A naive map fails: it takes no verdict away, however far its numbers run."""

import json

import pytest

from discmech import scenes
from discmech.studies import get
from discmech.studies.command.entry import main
from discmech.studies.command.output import strict_json
from discmech.studies.core.case import Case, Measurement
from discmech.studies.core.one_case import diagnosed
from discmech.studies.core.outcome import Found
from discmech.studies.order.judging import judge
from discmech.studies.order.records import BLEW_UP, Row
from tests.studies.as_json import run_case

from .naive_maps import BROKEN, FORMS, SOUND

FORGOT_H = """
from discmech import one_step

@one_step(order=1)
def forgot_h(s, z, h):
    return z + s.f(z)
"""


@pytest.mark.dear(but=("-z-", "left", "still", "squared", "doubled"))
@pytest.mark.dear("program-z")
@pytest.mark.sampled
@pytest.mark.parametrize("name", BROKEN)
@pytest.mark.parametrize("form", FORMS)
def test_the_order_of_a_naive_map_fails(name, form):
    rule = FORMS[form](name, BROKEN[name])
    told = json.loads(strict_json(run_case(get("order"), Case("order", HARMONIC, rule, 16, 16))))
    assert told["verdict"] == "fail" and told["reason"] and told["rows"]
    assert told.get("diagnosis", {}).get("cause") != "not found", told["reason"]


@pytest.mark.dear("euler", "program")
@pytest.mark.parametrize("name", SOUND)
@pytest.mark.parametrize("form", FORMS)
def test_the_order_of_a_right_map_passes(name, form):
    order, step = SOUND[name]
    rule = FORMS[form](name, step, order)
    assert run_case(get("order"), Case("order", HARMONIC, rule, 16))["verdict"] == "pass"


@pytest.mark.slow
def test_the_command_answers_for_a_map_that_forgot_h(tmp_path, capsys):
    file = tmp_path / "mine.py"
    file.write_text(FORGOT_H)
    assert main(["order", "harmonic", "--rule", str(file), "--json", "-"]) == 1
    cases = json.loads(capsys.readouterr().out)["cases"]
    assert cases and all(c["diagnosis"]["cause"] == "no step" for c in cases)


@pytest.mark.parametrize("end", [float("inf"), float("nan")])
def test_a_finest_run_that_blew_up_fails_whatever_the_others_do(end):
    rows = [Row(2**k, 2.0**-k).with_errors(4.0**-k, None, None) for k in range(3, 9)]
    case = Case("order", HARMONIC, FORMS["formula"]("any", *SOUND["explicit-midpoint"][::-1]), 16)
    blown = Row(2**9, 2.0**-9).with_errors(end, None, None)
    verdict = judge(case, Measurement.of({"rows": [*rows, blown], "certain": 30.0}))
    assert verdict.verdict == "fail" and BLEW_UP in verdict.reason


def test_an_error_in_the_search_for_a_cause_is_told_and_takes_no_verdict_away(monkeypatch):
    def fails(case, measurement):
        raise ValueError("math domain error")

    study = get("order")
    monkeypatch.setattr(study.judging, "diagnose", fails)
    case = Case("order", HARMONIC, FORMS["formula"]("doubled", BROKEN["doubled"]), 16, 16)
    cause = diagnosed(study, case, Found(Measurement({"order": None})))
    assert cause["cause"] == "not found" and "ValueError: math domain error" in cause["sentence"]


HARMONIC = scenes.get("harmonic")
