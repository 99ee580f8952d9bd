"""The whole report, from real measurements that are as small as they can be."""

import fcntl
import html
import io
import json
import os
import re
from contextlib import redirect_stdout
from functools import partial
from types import SimpleNamespace

import pytest

from discmech.integrators import StepFailure, rules, scenes
from discmech.studies import NAMES as ALL
from discmech.studies import get
from discmech.studies.command import report
from discmech.studies.command.entry import main
from discmech.studies.command.methods import about_methods
from discmech.studies.core.case import Choice, Verdict
from discmech.studies.core.family import same_steps, step_text
from discmech.studies.core.plan import Plan
from discmech.studies.core.side_by_side import answer
from discmech.studies.core.store import Store
from discmech.studies.core.study import every_study
from tests.studies.as_json import read

WORDS = [
    "report", "pendulum", "heavy-top", "--rule", "midpoint", "--digits", "16", "--steps", "200",
    "--jobs",
    "1",  # the measurements of this process are replaced
]  # fmt: skip
#: the studies of methods, and those of them that apply to these scenes
NAMES = tuple(name for name in ALL if not get(name).of_the_bench)
APART = ("stability", "contact", "lattices", "optimality", "steps")
APPLY = tuple(name for name in NAMES if name not in APART)
STOPPED = StepFailure("heavy-top", "midpoint", 3, 0.15, {"x": [1.0]}, "Newton did not converge")


def replace_measurements(monkeypatch, measure):
    for name in NAMES:
        monkeypatch.setattr(get(name).measuring, "measure", measure)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A report of two scenes in which one case in the middle fails: Newton gives up.

    Processes of pytest that run side by side share one.
    """
    base = tmp_path_factory.getbasetemp()
    place = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder, told = place / "report" / "build", place / "report.json"
    with (place / "report.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not told.exists():
            told.write_text(json.dumps(make(folder, tmp_path_factory.mktemp("kept"))))
    code, out = json.loads(told.read_text())
    results = [
        json.loads((folder / f"tables/{name}.json").read_text("utf-8"), parse_constant=pytest.fail)
        for name in APPLY
    ]
    page = folder / "index.html"
    return SimpleNamespace(code=code, out=out, page=page, results=results,
                           text=page.read_text("utf-8"))  # fmt: skip


def make(folder, kept):
    """Write it: the exit code of the command, and what it says."""
    good = {name: get(name).measuring.measure for name in NAMES}

    def measure(case, progress):
        if (case.study, case.scene.name) == ("energy", "heavy-top"):
            raise STOPPED
        return good[case.study](case, progress)

    with pytest.MonkeyPatch.context() as patch, redirect_stdout(io.StringIO()) as out:
        patch.setattr("discmech.studies.core.store.cache_folder", lambda: kept)
        patch.setattr("discmech.studies.work_precision.measuring.BUDGET", 0.03)  # of a race
        patch.setattr("discmech.studies.core.running.shrunk", lambda *_: {})
        replace_measurements(patch, measure)
        code = main([*WORDS, "--folder", str(folder)])
    return code, out.getvalue()


def test_every_study_is_on_the_page_with_the_command_of_every_case(made):
    assert [r["study"] for r in made.results] == list(APPLY)
    cases = [c for r in made.results for c in r["cases"]]
    ours = [c for c in cases if c.get("kind") != "peer"]
    assert len(ours) == 14  # the pendulum declares no symmetry, the heavy top has no extremes
    for case in cases:
        failing = (case["scene"], case["command"].split()[1]) == ("heavy-top", "energy")
        # a busy machine may leave a peer too few runs, and never a rule of ours
        if case.get("kind") != "peer" or "too few runs" not in case["reason"]:
            assert case["verdict"] == ("fail" if failing else "pass"), case["reason"]
        assert case["command"] in html.unescape(made.text)
    assert scenes.get("heavy-top").title in made.text


def test_a_case_that_fails_is_marked_and_the_exit_code_says_so(made):
    assert made.code == 1
    assert "Newton did not converge" in made.out and "index.html" in made.out
    assert "Newton did not converge at step 3, t = 0.15" in made.text
    assert "discmech energy heavy-top" in made.out  # and no table of what passed
    assert "pendulum, midpoint" not in made.out
    assert made.text.index("Newton did not converge") < made.text.index("cases pass</summary>")


def test_a_report_of_everything_leaves_out_digits_and_no_method():
    """Each study runs each rule on each kind of groupoid, unless its step is that of another.

    Each kind of scene and each simple rule is run at 50 digits.
    """
    studies = [study for study in every_study().values() if study.usual]
    same = same_steps(Choice().pairs(), partial(answer, step_text, None))
    assert {rule for _, rule in same} == {"midpoint", "trapezoidal"}
    assert {*same.values()} == {"rectangle"} and ("suslov", "midpoint") in same
    some, turns = report.chosen_of_all(studies, Choice(), same)
    whole, few = (
        [case for _, case in Plan.of_those_that_apply(studies, one).places()]
        for one in (Choice(), some)
    )
    ran, of_few = ({(c.study, c.scene.name, c.label) for c in cases} for cases in (whole, few))
    apart = {(scene, rule) for _, scene, rule in ran - of_few} - {*same}
    assert of_few < ran and {scene for scene, _ in apart} == {*turns}
    assert all(rule in rules.BUILT_IN and rule != turns[scene] for scene, rule in apart)
    shown = [SimpleNamespace(scene=c.scene.name, rule=c.label, digits=c.digits)
             for c in few if c.study == "momentum"]  # fmt: skip
    (said,) = (s for s in report.left_out(SimpleNamespace(cases=shown), same, turns) if "turn" in s)
    assert "outer-solar-system" in said and "henon-heiles" not in said and "kepler" not in said
    ran, of_few = (
        {(c.study, type(c.scene.groupoid), c.label) for c in cases
         if (c.scene.name, c.label) not in same} for cases in (whole, few)
    )  # fmt: skip
    assert ran == of_few
    for part in (lambda case: type(case.scene.groupoid), lambda case: case.rule.name):
        ran, of_few = ({part(c) for c in cases if c.digits == 50} for cases in (whole, few))
        assert ran == of_few
    assert sum(c.digits == 50 for c in few) < sum(c.digits == 50 for c in whole) / 3


def test_formulas_of_methods_are_kept(monkeypatch):
    pairs = [(scenes.get("pendulum"), rules.get(name)) for name in ("midpoint", "gauss-2")]
    first = about_methods(pairs, Store())
    assert "<math" in first[0]["formula"] and "stages" in first[1]["letters"]
    monkeypatch.setattr("discmech.studies.core.side_by_side.scheme_of", pytest.fail)
    assert about_methods(pairs, Store()) == first


def test_the_page_needs_nothing_but_itself(made):
    text = made.text
    loading = r"<(?:link|script|img|iframe|object|embed)\b[^>]*?(?:href|src)=[\"']([^\"']*)"
    loaded = re.findall(loading, text)
    assert all(address.startswith(("data:", "#")) for address in loaded)
    assert not re.search(r"@import|url\(\s*[\"']?https?:", text)
    local = re.findall(r'href="(?!#|https?:|data:)([^"]+)"', text)
    assert local and all((made.page.parent / address).is_file() for address in local)


def test_the_equations_of_every_scheme_are_typeset(made):
    text = made.text
    assert text.count("<math") >= 10 and "</math>" in text


def test_tables_and_figures_lie_beside_it(made):
    for name in APPLY:
        assert (made.page.parent / f"tables/{name}.csv").is_file()
    for kind, start in (("svg", b"<?xml"), ("png", b"\x89PNG")):
        files = list((made.page.parent / "figures").glob(f"*.{kind}"))
        assert files and all(f.read_bytes().startswith(start) for f in files)


def test_an_interrupted_report_leaves_the_old_one(made, monkeypatch, capsys):
    def interrupted(case, progress):
        raise KeyboardInterrupt

    folder = made.page.parent
    before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    replace_measurements(monkeypatch, interrupted)
    assert main([*WORDS, "--folder", str(folder)]) == 130
    assert before == {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    assert "goes on where it stopped" in capsys.readouterr().err


def test_a_folder_that_cannot_be_made_is_refused(monkeypatch, tmp_path, capsys):
    replace_measurements(monkeypatch, lambda case, progress: {"measured": {}, "rows": []})
    for name in NAMES:
        monkeypatch.setattr(get(name).judging, "judge", lambda case, measurement: Verdict("pass"))
    (tmp_path / "file").write_text("in the way")
    words = ["report", "kepler", "--rule", "midpoint", "--digits", "16"]
    assert main([*words, "--folder", str(tmp_path / "file" / "build")]) == 2
    assert "cannot be written" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words", [[], ["--bench"], ["--bench", "--digits", "16"], ["--bench", "--thorough"]]
)
def test_the_mutation_study_is_in_the_report_of_the_bench_and_a_survivor_fails_it(
    words, monkeypatch, tmp_path, capsys
):
    found = {"site": "rule", "what": "sign #0", "caught": [], "equivalent": ""}
    row = {"study": "order 50", "verdict": "pass", "reason": "", "seconds": 1.0}
    survivor = {"scene": "a", "rule": "b", "retraction": None, "digits": 16, "control": True,
                "verdict": "fail", "reason": "no study says no", "command": "", "measured_at": {},
                "expected": {"wanted": "caught"}, "measured": found, "rows": [row],
                "seconds": 1.0}  # fmt: skip
    made = {"study": "power", "verdict": "fail", "command": "discmech power", "record": {},
            "notes": [], "cases": [survivor]}  # fmt: skip

    def run_plan(plan, *_, **__):
        asked = [study.name for study in plan.studies]
        assert ("references" in asked) is ("power" in asked)
        assert ("charts" in asked) is ("savings" in asked) is ("--bench" in words)
        power = (study for study in plan.studies if study.name == "power")
        return ([study.completed(*read(made)) for study in power], [])

    monkeypatch.setattr(report, "run_plan", run_plan)
    monkeypatch.setattr("discmech.studies.proof.table.RULES", ())  # ten proofs take a minute
    code = main(["report", *words, "--folder", str(tmp_path / "build")])
    page = html.unescape((tmp_path / "build" / "index.html").read_text("utf-8"))
    whole = words in (["--bench"], ["--bench", "--thorough"])
    assert ("The power of the bench" in page and "no study says no" in page) is whole
    assert ("<code class=command>discmech power" in page) is whole
    assert (code == 1) is whole
