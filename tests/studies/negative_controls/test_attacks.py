"""The table of docs/verdicts.md: every command has the verdict that stands there."""

from __future__ import annotations

import json
import re
import shlex

import pytest

from discmech.studies.command import main
from tests.imports import ROOT

ROWS = re.findall(
    r"^\| (.+?) \| `discmech (.+?)` \| .+? \| (pass|fail)",
    (ROOT / "docs/verdicts.md").read_text(encoding="utf-8"),
    flags=re.M,
)


def test_the_table_is_read():
    assert len(ROWS) >= 11


@pytest.mark.slow
@pytest.mark.parametrize(("command", "verdict"), [row[1:] for row in ROWS])
def test_an_attack_has_the_verdict_of_the_table(command, verdict, monkeypatch, tmp_path):
    monkeypatch.chdir(ROOT / "docs/attacks")
    found = tmp_path / "found.json"
    main([*shlex.split(command), "--jobs", "1", "--json", str(found)])
    cases = json.loads(found.read_text(encoding="utf-8"))["cases"]
    assert [case["verdict"] for case in cases] == [verdict]
