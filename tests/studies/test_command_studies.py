"""The command of a study: table, JSON, page, exit code, and the command that its result names."""

import re
import shlex

import pytest

from discmech.integrators import scenes
from discmech.studies import NAMES, get
from discmech.studies.command.entry import _parser
from discmech.studies.command.options import as_typed, choice_of
from discmech.studies.core.case import Verdict, plain_cases
from discmech.studies.core.result import SCHEMA
from tests.studies.cached_results import SMALL, charts_slowly, measured_once
from tests.studies.commands import strict


@pytest.mark.slow
def test_a_scene_that_takes_no_rule_says_so(ask):
    words = ("order", "moser-veselov", "--digits", "16", "--rule")
    assert "midpoint has no part in it" in ask(*words, "midpoint")[1]
    assert "no part" not in ask(*words, "own")[1]
    words = ("verify", "examples/two_thirds.py", "--scene", "moser-veselov", "--study", "energy")
    assert "two-thirds has no part in it" in ask(*words, "--steps", "100")[1]


#: what the table of each study is made of, and names in JSON that stay; a study may say more
MEASURED = {
    "order": {"order", "interval", "points"},
    "symplecticity": {"pullback", "poisson", "residual"},
    "momentum": {"drift"},
    "energy": {"band", "slope", "slope_interval", "edge_slopes"},
    "work-precision": {"x", "y", "best", "cost", "ratio", "cut", "setup", "spread", "same_as",
                       "equal_time", "dearest"},
    "stability": {"stable_to", "intervals", "resonances", "off_circle", "runs", "proved",
                  "touched", "gaps"},
    "charts": {"residual", "pullback", "poisson", "momentum", "factorisation", "distance",
               "operator", "newton_max", "chart_turn", "margin", "starts", "steps", "changes",
               "translates", "stopped"},
    "extremes": {"fine", "coarse"},
    "savings": {"times"},
    "optimality": {"order", "interval", "points", "orders", "exact", "corrections", "cost"},
    "lattices": {"local", "space_order", "residual", "bond", "patch", "grows"},
    "steps": {"order", "back", "form", "band", "slope"},
    "contact": {"stepped", "located", "late", "rests", "order", "time_error", "form"},
}  # fmt: skip


@pytest.mark.dear("[stability]", "[lattices]", "[work-precision]", "steps", "energy", "contact",
                  "momentum", "optimality", "symplecticity")  # fmt: skip
@pytest.mark.parametrize("study", [*map(charts_slowly, NAMES)])
def test_each_study_as_a_table_and_as_json(ask, tmp_path, study):
    scene, steps = SMALL[study]
    alone = ["--peer", "none"] if study == "work-precision" else []  # what makes it one case
    rule = "reversible:midpoint" if study == "steps" else "midpoint"
    words = [study, scene, "--rule", rule, "--digits", "16", *alone, "--steps", str(steps)]
    file = tmp_path / "result.json"
    with measured_once():
        code, out, err = ask(*words, "--json", "-")
        found = strict(out)  # nothing else on standard output
        assert (code, err) == (0, "")
        named = ["--folder", str(tmp_path / "page"), "--label", f"{rule}=My method"]
        code, out, err = ask(*words, "--json", str(file), *named)
    (case,) = found["cases"]
    shown = "My method" if case["rule"] == rule else case["rule"]  # charts has a rule of its own
    for path in [*tmp_path.glob("page/tables/*.tex"), *tmp_path.glob("page/*.html")]:
        text = path.read_text("utf-8")  # the label is in each table, the rule's name in none
        assert f"\n{shown} &" in text or f"& {shown} &" in text or f">{shown}</td>" in text, path
        assert not re.search(rf"(\n|& ){rule} &|>{rule}</td>", text), path
    assert (found["study"], found["verdict"], found["schema"]) == (study, "pass", SCHEMA)
    assert found["command"] == " ".join(["discmech", *words])
    parts = {"scene", "rule", "retraction", "digits", "verdict", "expected", "measured", "rows"}
    assert parts <= set(case) and case["rows"] and case["expected"]
    assert set(case["measured"]) >= MEASURED[study]
    assert (code, err) == (0, "") and scene in out and "pass" in out
    assert strict(file.read_text())["cases"][0]["measured"] == case["measured"]


@pytest.mark.parametrize("words", [
    ("kepler", "--control", "Heun"),
    ("pendulum", "--control", "flipped bracket"),  # there is no anchor beside it
    ("pendulum", "--control", "Heun", "--rule", "midpoint"),
])  # fmt: skip
def test_a_control_that_cannot_be_run_there_says_where(ask, words):
    code, out, err = ask("symplecticity", *words)
    assert (code, out) == (2, "") and words[2] in err and "heavy-top" in err


def test_the_command_of_a_result_names_its_controls():
    words = ["symplecticity", "heavy-top", "--digits", "16", "--control", "Heun", "--control",
             "damped residual"]  # fmt: skip
    again = _parser().parse_args(shlex.split(as_typed(_parser().parse_args(words)))[1:])
    choice = choice_of(again)
    assert [c.control for c in get("symplecticity").cases(choice)] == ["Heun", "damped residual"]


def test_a_retraction_is_exchanged_and_the_command_says_so():
    words = ["order", "heavy-top", "pendulum", "--rule", "midpoint", "--digits", "16"]
    both = ["--retraction", "exponential", "--retraction", "cayley"]
    cases = plain_cases("order", choice_of(_parser().parse_args([*words, *both])), (16,))
    assert [c.scene.groupoid.retraction for c in cases] == ["exponential", "cayley", None]
    for case in cases:
        again = choice_of(_parser().parse_args(shlex.split(case.command)[1:]))
        ((scene, _),) = again.pairs()
        assert scene.groupoid.name == case.scene.groupoid.name


def test_no_scene_is_every_scene_and_a_retraction_leaves_pairs_in():
    everything = choice_of(_parser().parse_args(["order"]))
    assert {s.name for s, _ in everything.pairs()} == set(scenes.names())
    cayley = choice_of(_parser().parse_args(["order", "--retraction", "cayley"]))
    assert {s.name for s, _ in cayley.pairs()} == set(scenes.names())


@pytest.mark.parametrize(("verdict", "code"), [("pass", 0), ("fail", 1), ("inconclusive", 3)])
def test_exit_codes(ask, monkeypatch, verdict, code):
    study = get("momentum")
    nothing = {"measured": {"drift": {}}, "rows": [], "steps": 1}
    monkeypatch.setattr(study.measuring, "measure", lambda case, progress: nothing)
    monkeypatch.setattr(study.judging, "judge", lambda *_: Verdict(verdict, "so it is"))
    assert ask("momentum", "kepler", "--json", "-")[0] == code


def test_not_a_number_never_reaches_the_json(ask, monkeypatch):
    nothing = {"measured": {"drift": {"J": float("nan")}}, "steps": 1,
               "rows": [{"step": 1, "drift": {"J": float("inf")}}]}  # fmt: skip
    monkeypatch.setattr(get("momentum").measuring, "measure", lambda case, progress: nothing)
    code, out, _ = ask("momentum", "kepler", "--json", "-")
    assert code == 1
    case = strict(out)["cases"][0]
    assert case["measured"] == {"drift": {"J": None}} and case["rows"][0]["drift"] == {"J": None}


def test_a_study_by_itself_gives_its_page_figures_and_tables(ask, tmp_path):
    scene, steps = SMALL["stability"]
    words = ["stability", scene, "--rule", "midpoint", "--digits", "16", "--steps", str(steps)]
    with measured_once():
        code, out, _ = ask(*words, "--folder", str(tmp_path / "new"))
    assert code == 0 and f"page: {tmp_path}/new/index.html" in out.replace("\n", "")
    figures = [f"figures/stability-linear.{kind}" for kind in ("png", "svg")]
    tables = [f"tables/stability{end}" for end in (".csv", "-rows.csv", ".json", ".tex")]
    for name in figures + tables:
        assert (tmp_path / "new" / name).stat().st_size > 100
    text = (tmp_path / "new" / "index.html").read_text()
    assert " ".join(words) in text and scenes.get(scene).title in text
    assert scenes.get("kepler").title not in text
