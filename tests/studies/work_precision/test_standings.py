"""What an accuracy costs, by interpolation between runs; the table and the picture of it."""

import math
from dataclasses import replace

import pytest

from discmech.studies.core.result import Result, StudyResult, result_of
from discmech.studies.report import tables
from discmech.studies.report.canvas import figure_of
from discmech.studies.report.palette import marks
from discmech.studies.work_precision import plot as plot_work
from discmech.studies.work_precision import standings
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


def test_a_point_without_error_is_not_drawn():
    rows = [{"seconds": 1.0, "error": 0.0}, {"seconds": 1.0, "error": None},
            {"seconds": 2.0, "error": 1e-3}]  # fmt: skip
    assert [
        p[:2]
        for p in plot_work._points(result_of("work-precision", {"rows": rows}), "seconds", "error")
    ] == [(2.0, 1e-3)]


def raced(rule, run, *seconds, kind="rule", verdict="pass"):
    """A case of a race whose k-th run took so many seconds, with an error of 10⁻ᵏ."""
    rows = [{"seconds": s, "seconds_low": s, "seconds_high": s, "error": 10.0**-k}
            for k, s in enumerate(seconds)]  # fmt: skip
    extras = {"kind": kind, "race": {"run": run, "peers": {}, "step": None}}
    return Result("work-precision", "pendulum", rule, verdict=verdict, data=rows, extras=extras,
                  figures={"x": "seconds", "y": "error"})  # fmt: skip


def together(*cases):
    """The cases of one run."""
    peers = {case.rule: [(row["seconds"], row["error"]) for row in case.data]
             for case in cases if case.extras["kind"] == "peer"}  # fmt: skip
    return [replace(case, extras={**case.extras, "race": {**case.extras["race"], "peers": peers}})
            for case in cases]  # fmt: skip


def test_errors_at_equal_time_are_those_of_one_run():
    """A rule that was timed later, on a machine ten times as fast, is beside its own run alone."""
    cases = [raced("a", "1", 1, 10, 100), raced("b", "1", 1, 10), raced("c", "2", 0.1, 1)]
    found = [case.figures["equal_time"] for case in standings.beside_each_other(cases)]
    assert [one["seconds"] for one in found] == [10, 10, 1]


def test_a_method_that_fails_is_not_ranked():
    """It solves another problem: neither its cost, nor a ratio to it, nor a change of places."""
    quick = raced("quick", "1", *[1e-3] * 9, kind="peer", verdict="fail")
    slow = raced("slow", "1", *range(10, 19), kind="peer")
    wrong = raced("wrong", "1", *[1e-4] * 9, verdict="fail")
    right = raced("right", "1", *range(1, 10))
    found = standings.beside_each_other(together(wrong, right, quick, slow))
    by_name = {case.rule: case.figures for case in found}
    assert by_name["right"]["ratio"]["1e-04"] == pytest.approx(5 / 14)
    for name in ("quick", "wrong"):
        assert set(by_name[name]["cost"].values()) == set(by_name[name]["ratio"].values()) == {None}
        assert by_name[name]["equal_time"] is None
    details = found[0].details
    assert details.standing.leader == "rule" and not details.crossovers


def test_a_change_of_places_is_marked_or_denied():
    """It is denied only if one kind is faster by more than two runs differ at each accuracy."""

    def of(rule, peer):
        cases = together(raced("r", "1", *rule), raced("p", "1", *peer, kind="peer"))
        return standings.crossovers(cases, ("seconds", "error"))

    changes, standing = of([1, 2, 4, 8], [3, 3, 3, 3])
    assert [change["tighter"] for change in changes] == ["peer"]
    assert changes[0]["work"] == pytest.approx(3, rel=0.1) and standing["leader"] == "peer"
    lead = {"leader": "rule", "loosest": 1.0, "tightest": pytest.approx(1e-3), "sure": True}
    assert of([1, 1, 1, 1], [2, 2, 2, 2]) == ([], lead)
    assert of([1, 1, 1, 1], [2, 1.05, 1, 2]) == ([], {**lead, "sure": False})
    assert of([1, 1, 1, 1], [1, 1.05, 1, 0.99]) == ([], {**lead, "leader": None, "sure": False})
    assert of([1, 1], []) == ([], None)


def test_a_paper_s_table_has_the_times_of_a_race():
    """A column an accuracy; a race over many periods stands apart."""
    cost = {"1e-04": 1e-3, "1e-08": 2e-2, "1e-12": None}
    case = Result("work-precision", "kepler", "mine", verdict="pass",
                  figures={"x": "seconds", "cost": cost, "ratio": {"1e-04": 0.5}})  # fmt: skip
    cases = [case, replace(case, extras={"periods": 1000})]
    lines = tables.paper_tex(StudyResult(study="work-precision", cases=cases)).splitlines()
    assert lines[3].count("kepler, to 10") == 3 and "kepler, 1000 periods, to 10" in lines[3]
    assert lines[5] == r"mine & " + " & ".join([r"1 ms & 20 ms & ---"] * 2) + r" \\"


def test_the_picture_says_who_leads_and_where_the_budget_cut():
    """Every curve has a colour and a mark of its own; an arrow where the budget cut it."""
    names = ["midpoint", "gauss-2", "gauss-2, tolerance", "mine", "yours", "DOP853"]
    cases = together(*(
        raced(name, "1", 1, 2, 3, kind="peer" if name == "DOP853" else "rule") for name in names
    ))  # fmt: skip
    cases[0] = replace(cases[0], figures={**cases[0].figures, "cut": "64 steps, about 1 s"},
                       extras={**cases[0].extras, "floor": {"error": 1e-3}})  # fmt: skip
    found = standings.beside_each_other(cases)
    known = marks(names)
    panel = plot_work.panel("Race", found, known)
    (axes,) = figure_of([panel], plot_work.SHEET).axes
    assert "neither leads from 1 to 0.01" in panel.subtitle
    arrows = [text for text in axes.texts if text.get_text() == "" and text.arrow_patch is not None
              and "->" in str(text.arrowprops["arrowstyle"])]  # fmt: skip
    assert len(arrows) == 1
    drawn = {(str(line.get_markerfacecolor()), line.get_color(), line.get_marker())
             for line in axes.lines if line.get_marker() not in ("None", "|")}  # fmt: skip
    assert len(drawn) == len(names)
    (floor,) = [text for text in axes.texts if text.get_text() == plot_work.FLOOR]
    assert floor.get_window_extent().x0 > axes.bbox.x1  # beside the panel, where no curve is
