"""A new study is one new folder: its name, help, JSON, table and section of the report follow."""

from pathlib import Path

import pytest

from discmech.integrators import rules, scenes
from discmech.studies.command import main
from discmech.studies.core.case import Case
from discmech.studies.core.limits import Limit
from discmech.studies.core.result import StudyResult
from discmech.studies.core.study import StudyFolder, every_study
from discmech.studies.report.page import lone_page
from discmech.studies.stability.limits import LIMITS

ROOT = Path(__file__).resolve().parents[2]

DECLARED = '''"""How far the start of each scene is from the origin."""

from ..core.options import Option, whole
from ..core.study import StudyFolder

STUDY = StudyFolder(
    name="distance",
    package=__name__,
    place=3.5,
    title="Distance of the start",
    summary="how far the start is from the origin",
    asks="how far is the start from the origin?",
    measured="the length of x at the start",
    judged="it is finite",
    about="Nothing moves here. It can mislead: a start says nothing of the way.",
    options=(Option("--power", "of the length", "P", whole("--power", 9)),),
)
'''

MEASURING = '''"""The length of the start."""

from ..core.case import Verdict, plain_cases

NAME = "distance"
NEEDS = "it needs a base."
DIGITS = (16,)


def cases(choice):
    """All scenes that have a base."""
    assert choice.asked("power", 2) in range(1, 10)
    return [c for c in plain_cases(NAME, choice, DIGITS) if c.scene.x0]


def measure(case, progress):
    """The length of x0."""
    length = sum(float(e) ** 2 for e in case.scene.x0) ** 0.5
    return {"measured": {"length": length}, "rows": [{"length": length}]}


def judge(case, measurement):
    """Every length is finite."""
    return Verdict("pass", "", {"limit": 1e9})
'''

VIEW = '''"""How lengths are shown."""

from ..report.view import View, measured_column
from ..report.wording import limit

VIEW = View(columns=[measured_column("length", "Length at the start")], wanted=limit)
'''


def test_each_study_has_its_row_in_docs_judged():
    """A failure prints the row to paste."""
    judged = (ROOT / "docs" / "judged.md").read_text(encoding="utf-8")
    for study in every_study().values():
        # reversibility is measured only where a method claims it
        if isinstance(study, StudyFolder) and study.name != "reversibility":
            row = f"| {study.name} | {study.asks} | {study.measured} | "
            row += f"{study.with_limits(study.judged)} |"
            assert row in judged, f"paste into docs/judged.md: {row}"


def test_each_limit_has_its_row_in_docs_verdicts():
    """A failure prints the row to paste; a reason says if the number is derived or set."""
    page = (ROOT / "docs" / "verdicts.md").read_text(encoding="utf-8")
    for study in every_study().values():
        for name, what, value, reason in study.told_limits():
            row = f"| {study.name}: {name} | {what} | {value} | {reason} |"
            assert row in page, f"paste into docs/verdicts.md: {row}"
            assert reason.startswith(("derived: ", "set: ")), row


def test_a_limit_that_is_changed_changes_verdict_help_page_and_documentation(monkeypatch, capsys):
    study, name = every_study()["stability"], "resolved"
    of = Case("stability", scenes.get("kepler"), rules.midpoint, 16)
    row = {"z": 0.7, "stiffness": 1.0, "class": "failed"}
    found = {"kind": "map", "label": "stiffness", "rows": [row], "measured": {"classes": {}}}

    def told_of():
        verdict = study.judge(of, found)
        with pytest.raises(SystemExit):
            main(["stability", "--help"])
        page = lone_page([StudyResult(study="stability", verdict="pass")], [], "discmech")
        return verdict.verdict, verdict.expected["bounded_up_to"], capsys.readouterr().out, page

    assert told_of()[:2] == ("pass", LIMITS[name])
    monkeypatch.setitem(LIMITS, name, Limit(0.75, "a share", "set: to try it"))
    verdict, up_to, help_of, page = told_of()
    assert (verdict, up_to) == ("fail", 0.75) and "resolved 0.75, a share" in help_of
    assert "hω ≤ 0.75" in page and "set: to try it" in page
    with pytest.raises(AssertionError, match=r"paste .*stability: resolved \| a share \| 0.75"):
        test_each_limit_has_its_row_in_docs_verdicts()


def test_the_glossary_has_a_row_for_each_word():
    from discmech.studies.report.glossary import rows

    assert rows() in (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
