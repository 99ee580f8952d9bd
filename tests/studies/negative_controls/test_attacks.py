"""The tables of docs/verdicts.md: every command has the verdict that stands there.

Those of the first table in every unit of action too.
"""

import runpy
import sys

import pytest

from tests.imports import ROOT

RERUN = runpy.run_path(str(ROOT / "docs/attacks/rerun.py"))
ROWS = RERUN["rows"]()


def test_the_table_is_read():
    assert len(ROWS) >= 11
    # of one called numbers.py each script ended with 1, as a fail does
    assert not {p.stem for p in (ROOT / "docs/attacks").glob("*.py")} & sys.stdlib_module_names


@pytest.mark.slow
@pytest.mark.parametrize("unit", ["", "large", "small"])
@pytest.mark.parametrize(("words", "verdict"), [row[1:] for row in ROWS])
def test_an_attack_has_the_verdict_of_the_table(words, verdict, unit, monkeypatch):
    monkeypatch.chdir(ROOT / "docs/attacks")
    asked = RERUN["in_unit"](words, unit) if unit else words
    assert RERUN["verdict_of"](asked) == verdict


SECOND = RERUN["second_rows"]()


def in_turn(rows):
    """Of three sound rows one is in every run: the report has a thousand cases that pass."""
    sound = 0
    for kind, *row, slow in rows:
        sound += kind.startswith("sound")
        yield kind, *row, slow or (kind.startswith("sound") and sound % 3 != 1)


def test_the_later_tables_are_read_whole():
    page = (ROOT / "docs/verdicts.md").read_text("utf-8").partition("## The second attack")[2]
    tables = page.partition("\n## How the bench")[0]
    lines = [e for e in tables.splitlines() if e.startswith("|")]
    assert len(SECOND) == len(lines) - 2 * tables.count("\n|---"), (
        "a row is written in another form than rerun.py reads"
    )


@pytest.mark.dear("top ", "body ", "ball ", "energy ", "2 --digits 50]", "rule order.py:cheat ",
                  "rule programs.py:talks", "in_numbers.py:between", "rule programs.py:seventh ",
                  "rule programs.py:quarters ", "rule hamiltonian.py:slow_half ",
                  "rule form.py:symplectic_euler ", "rule programs.py:DampsFromThere",
                  "discmech contact contact.py:pegs ", "contact.py:nothing", "contact.py:falling",
                  "control.py:small", "steps kepler", "order.py:heavy --peer", "programs.py:bumped",
                  "programs.py:forth", "programs.py:heavier", "programs.py:Late",
                  "programs.py:lower", "programs.py:rounded",
                  "programs.py:short_band", "programs.py:jumps",
                  "conserved.py:pulled_long")  # fmt: skip
@pytest.mark.parametrize(("words", "answer"), [
    pytest.param(words, answer, marks=[pytest.mark.slow] if slow else [], id=" ".join(words))
    for _, words, answer, slow in in_turn(SECOND)
])  # fmt: skip
def test_an_attack_has_the_answer_of_the_second_table(words, answer, monkeypatch):
    monkeypatch.chdir(ROOT / "docs/attacks")
    assert RERUN["answer_of"](words) == answer
