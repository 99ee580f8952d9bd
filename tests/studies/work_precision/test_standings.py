"""What an accuracy costs, by interpolation between runs; the table and the picture of it."""

from __future__ import annotations

import math

import pytest

from discmech.studies.report.case import case_of
from discmech.studies.work_precision import axes, standings
from discmech.studies.work_precision import plot as plot_work
from tests.studies.work_precision.races import shown


def test_costs_lie_on_the_line_between_runs():
    rows = [{"seconds": 10.0**k, "error": 10.0 ** (-2 * k)} for k in range(5)]
    found = standings.cost(rows, ("seconds", "error"))
    assert found == {"1e-04": pytest.approx(100.0), "1e-08": pytest.approx(1e4), "1e-12": None}
    rows = [{"seconds": 3.0, "error": 1e-9}]
    assert standings.cost(rows, ("seconds", "error")) == {"1e-04": 3.0, "1e-08": 3.0, "1e-12": None}
    assert set(standings.cost([], ("seconds", "error")).values()) == {None}


def test_costs_do_not_jump_where_two_runs_take_the_same_time():
    """LSODA on the heavy top: of rtol 1e-9 and 1e-10 now this, now that is a little faster."""

    def cost(ninth, tenth):
        runs = ((0.43, 7e-8), (ninth, 1.3e-8), (tenth, 4e-10), (0.60, 2e-11))
        rows = [{"seconds": seconds, "error": error} for seconds, error in runs]
        return standings.cost(rows, ("seconds", "error"))["1e-08"]

    assert cost(0.5401, 0.54) == pytest.approx(cost(0.54, 0.5401), rel=1e-3)


def test_the_least_work_counts_where_the_line_turns():
    """More work with a larger error, and a looser setting that is slower and right by chance."""
    axes = ("seconds", "error")
    down_and_up = [
        {"seconds": s, "error": e} for s, e in ((1, 1e-3), (2, 1e-5), (4, 1e-3), (8, 1e-9))
    ]
    assert standings.cost(down_and_up, axes)["1e-04"] == pytest.approx(math.sqrt(2))
    slower = [{"seconds": s, "error": e} for s, e in ((3, 1e-5), (1, 1e-3), (2, 1e-5))]
    assert standings.cost(slower, axes)["1e-04"] == pytest.approx(math.sqrt(2))


def test_the_table_says_what_failed_and_what_was_cut():
    rows = [{"cause": "LSODA came to no end within the budget"}] * 2
    case = {
        "measured": {"best": None, "cut": "rtol 1e-04, about 3 s"},
        "rows": [*rows, {"cause": ""}],
    }
    assert shown("Best", case) == (
        "— (2 of 3 settings failed: LSODA came to no end within the budget; "
        "cut: rtol 1e-04, about 3 s)"
    )


def test_the_picture_and_the_study_name_the_same_axes():
    assert (*plot_work.ERRORS,) == axes.ERRORS and (*plot_work.WORK,) == axes.WORK


def test_a_point_without_error_is_not_drawn():
    rows = [{"seconds": 1.0, "error": 0.0}, {"seconds": 1.0, "error": None},
            {"seconds": 2.0, "error": 1e-3}]  # fmt: skip
    assert [
        p[:2]
        for p in plot_work._points(case_of("work-precision", {"rows": rows}), "seconds", "error")
    ] == [(2.0, 1e-3)]


def test_errors_at_equal_time_are_those_of_one_run():
    """A rule that was timed later, on a machine ten times as fast, is beside its own run alone."""

    def raced(rule, run, *seconds):
        rows = [{"seconds": s, "seconds_low": s, "seconds_high": s, "error": 10.0**-k}
                for k, s in enumerate(seconds)]  # fmt: skip
        return {"scene": "pendulum", "retraction": None, "periods": None, "rule": rule,
                "kind": "rule", "rows": rows, "measured": {"x": "seconds", "y": "error"},
                "race": {"run": run, "peers": {}, "step": None}}  # fmt: skip

    cases = [raced("a", "1", 1, 10, 100), raced("b", "1", 1, 10), raced("c", "2", 0.1, 1)]
    found = [case["measured"]["equal_time"] for case in standings.beside_each_other(cases)]
    assert [one["seconds"] for one in found] == [10, 10, 1]
