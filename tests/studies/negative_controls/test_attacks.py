"""The table of docs/verdicts.md: every command has the verdict that stands there, in every unit."""

from __future__ import annotations

import runpy

import pytest

from tests.imports import ROOT

RERUN = runpy.run_path(str(ROOT / "docs/attacks/rerun.py"))
ROWS = RERUN["rows"]()


def test_the_table_is_read():
    assert len(ROWS) >= 11


@pytest.mark.slow
@pytest.mark.parametrize("unit", ["", "large", "small"])
@pytest.mark.parametrize(("words", "verdict"), [row[1:] for row in ROWS])
def test_an_attack_has_the_verdict_of_the_table(words, verdict, unit, monkeypatch):
    monkeypatch.chdir(ROOT / "docs/attacks")
    asked = RERUN["in_unit"](words, unit) if unit else words
    assert RERUN["verdict_of"](asked) == verdict
