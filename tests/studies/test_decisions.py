"""What measuring asks of judges is kept with the measurement, and asked again before it is used."""

import json
import math
from dataclasses import replace
from functools import cache

import pytest

from discmech.integrators import scenes
from discmech.integrators.rules import midpoint
from discmech.studies import get
from discmech.studies.core.case import Choice
from discmech.studies.core.decisions import Decision, decision, decisions, same_answers
from discmech.studies.core.outcome import Found
from discmech.studies.core.store import Store
from discmech.studies.energy.judging_errors import is_wide, verdict_of_run
from discmech.studies.energy.limits import LIMITS as OF_ENERGY
from discmech.studies.energy.records import Found as OfEnergy
from discmech.studies.energy.records import Measured
from tests.studies.as_json import run_study

LIMIT = {"most": 1.0}


@decision
def is_small(values: list[float]) -> bool:
    return max(values) <= LIMIT["most"]


@decision
def share(value: float) -> float:
    return value / LIMIT["most"] if is_small([value]) else math.nan


@cache
def small_once(value: float) -> bool:
    return is_small([value])


def test_a_decision_in_a_cache_is_told_by_each_test_of_a_study():
    with decisions(), pytest.raises(AssertionError, match="is_small, in a cache of small_once"):
        small_once(0.5)


def kept(made):
    """Decisions as the store gives them."""
    return Found.of_json(json.loads(json.dumps(Found(decisions=made).to_json()))).decisions


def test_a_decision_is_kept_by_all_measurements_that_rest_on_it_and_asked_again(monkeypatch):
    assert is_small([0.5])  # of no measurement
    with decisions() as outer:
        is_small([0.5, 0.75])
        with decisions() as inner:
            assert share(0.5) == 0.5 and math.isnan(share(2.0))
    assert [made.answer for made in outer[:2]] == [True, 0.5]
    assert outer[1:] == inner and len(inner) == 2  # what a decision asks is none of its own
    for made in (outer, inner):
        assert same_answers(kept(made))
    monkeypatch.setitem(LIMIT, "most", 0.8)
    assert same_answers(kept(outer[:1])) and not same_answers(kept(inner))
    monkeypatch.setitem(LIMIT, "most", 0.7)
    assert not same_answers(kept(outer[:1]))


@pytest.mark.parametrize("name", ["os:getcwd", "nowhere:is_small", f"{__name__}:gone", ""])
def test_what_is_no_decision_any_more_is_not_believed(name):
    assert not same_answers([Decision(name, [], None)])
    assert not same_answers([Decision(f"{__name__}:is_small", [[0.5], 1], True)])


def test_records_go_through_the_store():
    with decisions() as made:
        run = OfEnergy(measured=Measured(0.01, 0.0, (-1, 1)), duration=10.0)
        assert verdict_of_run(2.0**-53, run) == "pass" and is_wide(math.nan)
    assert same_answers(kept(made))
    assert not same_answers([replace(made[0], answer="fail")])


def run():
    choice = Choice((scenes.get("pendulum"),), (midpoint,), digits=(16,), steps=2000)
    told = run_study(get("energy"), choice, store=Store())
    return told["verdict"], any("by an earlier run" in note for note in told["notes"])


def test_a_changed_limit_of_the_energy_measures_anew_only_where_it_decides(monkeypatch):
    assert run() == ("pass", False) and run() == ("pass", True)
    monkeypatch.setitem(OF_ENERGY, "turns", OF_ENERGY["turns"] + 1)
    assert run() == ("pass", True)
    monkeypatch.setitem(OF_ENERGY, "whole", 0)  # no band is small enough for a modified energy
    monkeypatch.setitem(OF_ENERGY, "slope", 0)
    verdict, remembered = run()
    assert verdict != "pass" and not remembered
    assert run() == (verdict, True)
