"""Records of measurements: what is read from JSON and written again is the same."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import pytest

from discmech.studies.core.records import OPTIONAL, SPREAD, decoded, encoded
from discmech.studies.core.result import SCHEMA
from discmech.studies.core.single_steps import Departure, SingleSteps
from discmech.studies.core.study import every_study


@dataclass(frozen=True, slots=True)
class Inner:
    value: float | None = None


@dataclass(frozen=True, slots=True)
class Outer:
    step: float = 0.0
    inner: Inner | None = None
    rows: Sequence[Inner] = ()
    least: float | None = field(default=None, metadata={"key": "at-least", **OPTIONAL})
    others: Mapping[str, float | None] = field(default_factory=dict, metadata=SPREAD)


WHOLE = {"step": 0.5, "inner": {"value": None}, "rows": [{"value": 1.0}, {"value": 2.0}],
         "at-least": 3.0, "pullback": None, "poisson": 1e-16}  # fmt: skip


def test_what_was_written_is_read_and_the_other_way_round():
    made = decoded(Outer, WHOLE)
    assert made.rows[1].value == 2.0 and made.least == 3.0
    assert made.others == {"pullback": None, "poisson": 1e-16}
    assert encoded(made) == WHOLE and list(encoded(made)) == list(WHOLE)
    assert encoded(Outer()) == {"step": 0.0, "inner": None, "rows": []}


def test_a_view_meets_no_number_that_is_not_finite():
    given = {"value": math.nan}
    assert math.isnan(decoded(Inner, given).value)
    for odd in (math.nan, math.inf, "word", True, None):
        assert decoded(Inner, {"value": odd}, finite=True).value is None
    assert decoded(Outer, None) == Outer() and decoded(dict, None) == {}


@pytest.mark.parametrize("study", every_study().values(), ids=lambda study: study.name)
def test_every_record_of_a_view_can_be_read_from_nothing(study):
    for kind in (study.view.measured, study.view.expected, study.view.row):
        assert decoded(kind, {}) == kind()


def test_keys_of_single_steps_are_those_of_the_schema():
    """Where a key goes or has another name, docs/results.md says so and the schema rises."""
    assert SCHEMA == 2
    keys = encoded(SingleSteps(laws={"form": Departure()}, on_motion=1.0, rate=1.0))
    assert {
        "order",
        "component",
        "step",
        "place",
        "places",
        "seed",
        "exact",
        "unknown",
        "refused",
        "floats",
        "on_motion",
        "rate",
        "linear",
        "floor",
        "share",
        "laws",
    } <= set(keys)
    assert set(keys["laws"]["form"]) >= {"size", "limit", "name", "step", "place", "unknown"}
