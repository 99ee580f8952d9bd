"""The badge that `verify --badge` writes: a picture with words, for eyes, ears and grey screens."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from contextlib import suppress

import pytest

from discmech.studies.command import main
from discmech.studies.core.outcome import worst
from discmech.studies.core.result import Result, StudyResult
from discmech.studies.report.badge import GREY, LOOKS, badge

SVG = "{http://www.w3.org/2000/svg}"


def result(*verdicts: str) -> StudyResult:
    return StudyResult(verdict=worst(verdicts), cases=[Result(verdict=v) for v in verdicts])


def contrast(colour: str) -> float:
    """That of white on a colour (WCAG 2, relative luminance)."""
    whole = colour[1:] if len(colour) == 7 else "".join(2 * c for c in colour[1:])
    parts = [int(whole[k : k + 2], 16) / 255 for k in (0, 2, 4)]
    linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 1.05 / (0.05 + sum(w * c for w, c in zip((0.2126, 0.7152, 0.0722), linear, strict=True)))


@pytest.mark.parametrize("verdict", LOOKS)
def test_it_says_the_verdict_in_words_and_counts_the_cases(verdict):
    others = ["measured" if verdict == "measured" else "pass"] * 2
    root = ElementTree.fromstring(badge(result(verdict, *others), 'my "code" <1>'))
    title = root.find(f"{SVG}title").text
    assert root.get("role") == "img" and root.get("aria-label") == title
    assert title.startswith(f'my "code" <1>: {verdict} (') and others[0] in title
    assert [e.text for e in root.iter(f"{SVG}text")][1].endswith(verdict)


def test_it_can_be_read():
    assert min(map(contrast, [GREY, *(colour for _, colour in LOOKS.values())])) >= 4.5


def test_verify_writes_it_with_the_exit_code_of_the_verdict(tmp_path, capsys):
    file = tmp_path / "badge.svg"
    words = ["verify", "midpoint", "--scene", "harmonic", "--study", "order", "--digits", "16"]
    assert main([*words, "--badge", str(file)]) == 0
    assert "pass" in file.read_text("utf-8") and "<title>" in file.read_text("utf-8")
    for wrong in (["--scene", "nowhere"], ["--digits", "3"], ["--unknown"], ["--html", "-"]):
        main([*words, "--badge", str(file)])
        for name in (file, tmp_path / "fresh" / f"{len(wrong[0])}.svg"):
            with suppress(SystemExit):
                assert main([*words, *wrong, f"--badge={name}"]) == 2
            assert "inconclusive (no case)" in name.read_text("utf-8")
    (other := tmp_path / "other.svg").write_text("<svg aria-label='of somebody'/>")
    assert main([*words, "--badge", str(other)]) == 2 and "somebody" in other.read_text("utf-8")
    assert main([*words, "--badge", "-"]) == 2
    (tmp_path / "none").touch()
    assert main([*words, "--badge", str(tmp_path / "none" / "badge.svg")]) == 2
    capsys.readouterr()
    for option, said in (("--save-baseline", "saved as the baseline"), ("--baseline", "1 equal")):
        assert main([*words, option, "verified"]) == 0
        assert said in capsys.readouterr().out
