"""What runs of the report found is kept, within limits, and drawn where it changed."""

import re
import sqlite3
from dataclasses import replace

import pytest

from discmech.studies.command.report import make_report
from discmech.studies.core import history
from discmech.studies.core.case import Choice
from discmech.studies.core.history import Found, History
from discmech.studies.core.result import result_of
from discmech.studies.core.store import Store
from discmech.studies.report.page import write_report
from discmech.studies.report.sparkline import ROOM, Sparklines, sparkline
from discmech.studies.report.tables import short
from discmech.studies.report.wording import scientific
from tests.studies.as_json import read
from tests.studies.fake_results import case, results

RUNS = "SELECT name FROM entry WHERE kind = 'run' ORDER BY name"


def order(value=2.0001, scene="kepler", verdict="pass", **more):
    one = case("order", scene, "midpoint", 16, measured={"order": value}, verdict=verdict, **more)
    (whole,) = read({"study": "order", "verdict": verdict, "cases": [one]})
    return whole


def run(*found, store=None):
    """A report's run as the command keeps it; the history with it."""
    whole = History(store or Store())
    whole.add(found, short)
    whole.keep()
    return whole


def figures(whole, result):
    return [found.figure for found in whole.of(result.cases[0])]


def test_what_each_run_found_comes_back_in_order():
    run(order(1.9998))
    run(order(1.0, scene="pendulum"))  # a run without the case
    whole = run(order(2.0001, verdict="fail"), store=Store(fresh=True))
    assert figures(whole, order()) == ["1.9998", "2.0001"]
    assert [found.verdict for found in whole.of(order().cases[0])] == ["pass", "fail"]
    assert figures(whole, order(scene="pendulum")) == ["1.0000"]
    assert figures(History(Store()), order()) == ["1.9998", "2.0001"]
    assert whole.runs[-1]["machine"] and whole.runs[-1]["date"] and "commit" in whole.runs[-1]


def test_of_sixty_runs_the_last_fifty_are_kept(rows):
    for k in range(60):
        whole = run(order(2 + k / 1000))
    assert figures(whole, order()) == [f"{2 + k / 1000:.4f}" for k in range(10, 60)]
    assert len(rows(RUNS)) == 50 and figures(History(Store()), order()) == figures(whole, order())


def test_the_oldest_go_where_all_are_too_large(rows, monkeypatch):
    run(order(1.0))
    ((size,),) = rows("SELECT length(content) FROM entry WHERE kind = 'run'")
    monkeypatch.setattr(history, "LARGEST", 3 * size + 2)
    for value in (2.0, 3.0, 4.0):
        run(order(value))
    assert figures(History(Store()), order()) == ["2.0000", "3.0000", "4.0000"]
    assert len(rows(RUNS)) == 3


def test_a_run_of_the_whole_bench_has_room():
    """1,000 cases of figures as long as those of the studies, 50 times."""
    one = order(2.0001).cases[0]
    many = [replace(one, command=f"discmech order scene-{k}") for k in range(1000)]
    size = sum(len(history._name(case)) + len('"":["2.2×10⁻¹⁶, pass","inconclusive"],'.encode())
               for case in many)  # fmt: skip
    assert 50 * size < history.LARGEST


def test_a_damaged_run_is_said_and_left_out(rows):
    for value in (1.0, 2.0, 3.0):
        run(order(value))
    rows("UPDATE entry SET content = 'half' WHERE name = ?", rows(RUNS)[1][0])
    store = Store()
    assert figures(History(store), order()) == ["1.0000", "3.0000"]
    assert "damaged" in store.troubles["history"] and len(rows(RUNS)) == 2
    History(again := Store())
    assert not again.troubles


def test_two_reports_at_once_lose_nothing():
    first, second = History(Store()), History(Store())
    for whole, value in ((first, 1.0), (second, 2.0)):
        whole.add([order(value)], short)
    first.keep()
    second.keep()
    assert figures(History(Store()), order()) == ["1.0000", "2.0000"]


def test_a_full_disk_is_a_sentence(monkeypatch):
    def full(*_):
        raise sqlite3.OperationalError("database or disk is full")

    run(order(1.0))
    monkeypatch.setattr(Store, "_write", full)
    whole = run(order(2.0), store=(store := Store()))
    assert figures(whole, order()) == ["1.0000", "2.0000"]
    assert "disk is full" in store.troubles["history"]
    assert figures(History(Store()), order()) == ["1.0000"]


def past(*figures, verdicts=None, commit="abc1234"):
    said = verdicts or ["pass"] * len(figures)
    return [Found(f"2026-11-{k + 1:02}T10:00:00+00:00", commit, figure, verdict)
            for k, (figure, verdict) in enumerate(zip(figures, said, strict=True))]  # fmt: skip


def title(line):
    return re.search("<title>(.*)</title>", line)[1]


@pytest.mark.parametrize("figures", [(), ("2.0001",), ("2.0001",) * 50])
def test_what_never_changed_has_no_line(figures):
    assert sparkline(past(*figures)) == ""


@pytest.mark.parametrize(("runs", "told"), [
    (past("1.9998", "2.0001"), "2.0001 in 1 run, since 2026-11-02 (commit abc1234); "
     "before: 1.9998 in 1 run"),
    (past("2", *["<3"] * 12, commit=""), "&lt;3 in 12 runs, since 2026-11-02: unchanged; "
     "before: 2 in 1 run"),
    (past("2", "2", "2", verdicts=["pass", "fail", "pass"], commit=""),
     "2, pass, in 1 run, since 2026-11-03; before: 2, fail, in 1 run; 2 changes in 3 runs"),
])  # fmt: skip
def test_its_words(runs, told):
    assert title(sparkline(runs)) == told


@pytest.mark.parametrize(("figures", "d", "end"), [
    (("2.0", "2.5", "3.0"), "M0 12 30 6 60 0", 0),
    (("band 10⁻¹⁶", "band 10⁻¹⁴", "band 1.0×10⁻¹⁵"), "M0 12 30 0 60 6", 6),  # decades
    (("to hω = 2", "at no hω", "to hω = 2"), "M0 12 30 0 60 12", 12),  # no number in each
    (("stopped", "stopped", "right"), "M0 12 30 12 60 0", 0),
])  # fmt: skip
def test_its_shape(figures, d, end):
    line = sparkline(past(*figures))
    assert f'<path d="{d}"/><path class=pass d="M60 {end}h0"/>' in line


def test_a_verdict_that_changed_is_marked_in_its_colour():
    line = sparkline(past("1", "1", "2", "2", verdicts=["pass", "fail", "fail", "pass"]))
    assert line.count("class=fail") == 1 and 'class=fail d="M20 ' in line
    assert re.search('class=pass d="M60 [0-9]+h0"', line)


def test_it_is_small_and_all_have_a_limit():
    many = past(*(scientific(10.0**-k * (1 + k % 7)) for k in range(29)))
    assert len(sparkline(many[:2]).encode()) < 300 and len(sparkline(many).encode()) < 600
    lines = Sparklines(lambda case: many)
    drawn = "".join(lines.of(result_of("order", {"verdict": "pass"})) for _ in range(1000))
    assert len(drawn.encode()) <= ROOM[True] and lines.left_out == 1000 - lines.drawn > 0
    assert lines.of(result_of("order", {"verdict": "fail"}))  # however many others changed


@pytest.mark.slow
def test_the_page_has_one_in_the_row_that_changed_and_in_no_other(tmp_path):
    (order, *_) = read(*results((16,)))
    *others, changed = order.cases[:4]
    before = replace(changed, figures={**changed.figures, "order": 1.5})
    run(replace(order, cases=[*others, before]))
    now = [replace(order, cases=[*others, changed])]
    whole = run(*now)
    text = write_report(now, [], [], tmp_path, past=whole.of).read_text(encoding="utf-8")
    (row,) = [row for row in text.split("<tr") if "<svg class=past" in row]
    assert changed.command in row and "before: 1.5000 in 1 run" in title(row)
    assert text.count("A small line beside a verdict") == 1
    plain = write_report(now, [], [], tmp_path).read_text(encoding="utf-8")
    assert "class=past" not in plain and "A small line" not in plain


def test_a_report_joins_the_history_once_its_page_is_written(tmp_path, monkeypatch):
    from discmech.studies.command import report

    found = [order(2.0001)]
    monkeypatch.setattr(report, "run_plan", lambda *a, **k: (found, []))
    monkeypatch.setattr("discmech.studies.report.page.machine", lambda _: 1 / 0)
    ask = Choice(digits=(16,))
    with pytest.raises(ZeroDivisionError):
        make_report(ask, tmp_path / "build", store=Store())
    monkeypatch.setattr("discmech.studies.report.page.machine", lambda _: [])
    assert not History(Store()).runs
    make_report(ask, tmp_path / "build", store=Store())
    found[0] = order(1.9)
    _, page = make_report(ask, tmp_path / "build", store=Store())
    assert "1.9000 in 1 run, since" in page.read_text(encoding="utf-8")
    assert figures(History(Store()), found[0]) == ["2.0001", "1.9000"]
