"""The judge of charts and extremes: at its limits and beside them."""

import math

import pytest

from discmech.tests.bench.charts.limits import FORMS, SOLVED
from discmech.tests.bench.charts.limits import LIMITS as OF_CHARTS
from tests.studies.judges.by_hand import ABOVE, BELOW, case, close, judged

SINGULAR = OF_CHARTS["singular"]
LIMITS = dict.fromkeys(SOLVED, 1e-13) | dict.fromkeys(FORMS, 1e-12)


def turned(**more):
    row = dict.fromkeys((*LIMITS, "momentum"), 0.0)
    return row | {"turn": 0.25, "axis": 1, "steps": 100, "regularity": 1.0, "solutions": 1,
                  "outcome": "ran", "cause": None} | more  # fmt: skip


def chart_of(*rows, stopped=0, digits=16):
    return judged("charts", case(digits), rows=rows, measured={"stopped": stopped})


def walk_of(steps):
    """Five standard deviations of so many steps that are each off by 64 round-offs at most."""
    return 5 / math.sqrt(3) * 64 * 2.0**-53 * math.sqrt(steps)


@pytest.mark.parametrize(("digits", "unit"), [(16, 1.0), (30, 1e-14)])
@pytest.mark.parametrize("kind", [*LIMITS, "momentum"])
def test_every_law_holds_across_charts(kind, digits, unit):
    limit = (LIMITS | {"momentum": walk_of(100)})[kind] * unit
    told = chart_of(turned(**{kind: BELOW * limit}), digits=digits)
    assert told[:2] == ("pass", "") and told[2]["singular"] == SINGULAR
    assert told[2]["limits"] == close({k: v * unit for k, v in LIMITS.items()})
    assert chart_of(turned(**{kind: None}), digits=digits)[0] == "pass"
    for wrong in (ABOVE * limit, math.nan):
        verdict, reason, _ = chart_of(turned(), turned(**{kind: wrong}), digits=digits)
        assert verdict == "fail" and reason.startswith(
            f"{kind} {wrong:.2g} at 0.25 of a turn about"
        )


def test_momentum_may_walk_by_what_a_step_may_be_off():
    limit = walk_of(10**6)
    assert chart_of(turned(steps=10**6, momentum=limit))[0] == "pass"
    assert chart_of(turned(steps=10**6, momentum=ABOVE * limit))[0] == "fail"


def test_a_run_may_stop_only_where_nothing_follows():
    stopped = {"outcome": "stopped", "cause": "because"}
    verdict, reason, _ = chart_of(turned(**stopped))
    assert verdict == "fail" and reason == "it stopped at 0.25 of a turn about axis 1: because."
    assert chart_of(turned(**stopped, regularity=SINGULAR))[0] == "fail"
    for excuse in ({"regularity": BELOW * SINGULAR}, {"solutions": 0}, {"steps": 0}):
        assert chart_of(turned(**stopped, **excuse))[0] == "pass"
    assert chart_of(turned(**stopped, regularity=None))[0] == "fail"
    assert chart_of(turned(**stopped, solutions=None))[0] == "fail"
    assert chart_of(*[turned()] * 20, stopped=2)[0] == "pass"
    assert chart_of(*[turned()] * 20, stopped=1)[0] == "pass"
    told = chart_of(*[turned()] * 29, stopped=3)
    assert told[0] == "inconclusive" and told[1].startswith("3 runs stopped")


def test_nothing_wrong_goes_without_a_sign():
    def row(outcome, noticed=""):
        return {"outcome": outcome, "noticed": noticed, "z": 0.5, "error": 0.25, "estimate": 1e-3}

    def told(*rows):
        return judged("extremes", None, rows=rows)

    assert told(row("right"), row("wrong, told")) == ("pass", "", {"silent": 0})
    verdict, reason, _ = told(row("no reference"), row("wrong, silent"))
    assert verdict == "fail" and "at hω = 0.5 is wrong by 0.25" in reason and "(0.001)" in reason
    assert told(row("right"), row("no reference"))[0] == "inconclusive"
    assert told(row("no reference", "energy"), row("right"))[0] == "pass"
    assert told(row("right", "energy"))[0] == told(row("failed"))[0] == "pass"
