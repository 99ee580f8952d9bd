"""discmech compare: methods side by side, with ratios to the best."""

import json
import os
from dataclasses import replace

import pytest

from discmech import exponential, scenes
from discmech.studies.command.entry import main
from discmech.studies.core.result import Result, StudyResult, result_of
from discmech.studies.report import verdicts
from discmech.studies.symplecticity.view import VIEW
from discmech.studies.user.compare import comparison
from tests.studies.test_userfile import RULE


def case(study, rule, measured, rows=(), digits=16):
    return Result(study, "kepler", rule, None, digits, figures=measured, data=list(rows))


def ladder(*pairs):
    return [{"step": step, "error": error} for step, error in pairs]


def test_errors_are_compared_at_the_smallest_step_that_all_have():
    found = comparison([
        case("order", "a", {"order": 2.0}, ladder((0.2, 4e-4), (0.1, 1e-4), (0.05, 2.5e-5))),
        case("order", "b", {"order": 2.0}, ladder((0.4, 4e-3), (0.2, 8e-4), (0.1, 2e-4))),
        case("order", "c", {"order": None}, ladder((0.1, 1e-16), (0.2, None))),  # round-off, failed
    ])  # fmt: skip
    assert [line.get("step") for line in found] == [0.1, 0.1, None]
    assert [line["ratios"].get("error") for line in found] == [1, 2, None]


def test_times_are_compared_at_the_smallest_error_that_all_reach():
    found = comparison([
        case("work-precision", "a", {"cost": {"1e-04": 1.0, "1e-08": 3.0}}),
        case("work-precision", "b", {"cost": {"1e-04": 0.5, "1e-08": None}}),
        case("energy", "a", {"band": 1e-3}), case("energy", "b", {"band": 3e-3}),
    ])  # fmt: skip
    assert [(line["accuracy"], line["seconds"]) for line in found] == [(1e-4, 1.0), (1e-4, 0.5)]
    assert found[0]["ratios"] == {"seconds": 2, "band": 1}
    assert found[1]["ratios"] == {"seconds": 1, "band": pytest.approx(3)}


def test_what_is_not_finite_has_no_number():
    found = comparison([
        case("energy", "a", {"band": 1e-3}), case("energy", "b", {"band": float("inf")}),
        case("order", "a", {"order": 2.0}, ladder((0.1, 1e-4))),
        case("order", "b", {"order": None}, ladder((0.1, 1e22))),
        replace(case("energy", "c", {}), verdict="fail", reason="a step failed"),
    ])  # fmt: skip
    a, b, c = found
    assert b["not_finite"] == c["not_finite"] == ["band"] and "band" not in b
    assert b["error"] == 1e22 and b["ratios"] == {} and a["ratios"] == {"band": 1, "error": 1}
    lines = verdicts.comparison(StudyResult(comparison=found))["lines"]
    assert [line[-1] for line in lines] == ["10⁻³ (1×)", "not finite", "not finite"]


def test_precisions_are_not_compared_with_each_other():
    found = comparison([
        case("order", "a", {"order": 2.0}, ladder((0.1, 1e-4))),
        case("order", "a", {"order": 2.0}, ladder((0.01, 1e-6)), digits=50),
    ])  # fmt: skip
    assert [line["ratios"]["error"] for line in found] == [1, 1]


@pytest.mark.slow
def test_the_command(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(RULE)
    words = ["compare", "mine.py", "midpoint", "trapezoidal", "--scene", "kepler", "--study",
             "order", "--digits", "50", "--html", "found.html", "--json", "found.json"]  # fmt: skip
    assert main(words) == 0
    shown = capsys.readouterr().out
    assert "Side by side" in shown and "compare: pass" in shown
    found = json.loads((tmp_path / "found.json").read_text())
    rules = [line["rule"] for line in found["comparison"]]
    assert rules == ["two-thirds", "midpoint", "trapezoidal"]
    errors = {line["rule"]: line["ratios"]["error"] for line in found["comparison"]}
    assert min(errors.values()) == 1 and all(1 <= ratio < 3 for ratio in errors.values())
    assert " at h = " in shown
    assert {(tmp_path / f"found.{kind}").stat().st_mode & 0o777 for kind in ("html", "json")} == {
        0o666 & ~umask()
    }
    page = (tmp_path / "found.html").read_text()
    assert "Side by side" in page and page.count("<svg") > 1
    named = [
        *words[: words.index("--html")],
        "--folder",
        "out",
        "--label",
        "midpoint=The Gauss rule",
    ]
    assert main(named) == 0 and "page: out/index.html" in capsys.readouterr().out
    assert {path.suffix for path in (tmp_path / "out/figures").iterdir()} == {
        ".svg",
        ".pdf",
        ".png",
    }
    assert {"order.csv", "order-paper.tex"} <= {p.name for p in (tmp_path / "out/tables").iterdir()}
    page = (tmp_path / "out/index.html").read_text()
    assert "Side by side" in page and "--folder out --label" in page
    # a figure; the two tables above the studies, and a row of the study
    assert page.count(">The Gauss rule</td>") >= 3 and ">midpoint</td>" not in page


def umask():
    mask = os.umask(0)
    os.umask(mask)
    return mask


def test_one_method_is_none_to_compare(capsys):
    assert main(["compare", "midpoint"]) == 2
    assert "at least two" in capsys.readouterr().err


@pytest.mark.slow
def test_two_retractions_stand_side_by_side(capsys):
    words = ["compare", "midpoint", "--scene", "rigid-body", "--study", "order", "--digits", "16"]
    charts = ["--retraction", "cayley", "--retraction", "exponential"]
    assert main([*words, *charts, "--json", "-"]) == 0
    lines = json.loads(capsys.readouterr().out)["comparison"]
    assert [line["retraction"] for line in lines] == ["cayley", "exponential"]
    assert min(line["ratios"]["error"] for line in lines) == 1
    assert main(words) == 2 and "or two retractions of one" in capsys.readouterr().err
    body = scenes.get("rigid-body")
    assert body.with_retraction(exponential, name="by-exp").name == "by-exp"
    assert body.with_retraction(exponential).name == body.name


def test_a_residual_is_no_defect_of_a_form_that_is_not_demanded():
    entries = {"scene": "rolling-disc", "rule": "midpoint", "verdict": "pass",
               "measured": {"poisson": 1.0, "residual": 1e-17},
               "expected": {"limit": 1e-13, "demanded": ["residual"]}}  # fmt: skip
    assert VIEW.compared(result_of("symplecticity", entries)) == {}
    entries["expected"] = {"limit": 1e-13}
    entries["measured"]["residual"] = 2.0  # which is not the form's own
    assert VIEW.compared(result_of("symplecticity", entries))["defect"] == 1
