"""What the README shows runs, and what it names is there."""

import re

import pytest

from tests.imports import ROOT
from tests.pages import commands, run_blocks

PAGE = ROOT / "README.md"
TEXT = PAGE.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def namespace():
    """The Python blocks imported."""
    return run_blocks(PAGE, "readme")


@pytest.mark.slow
def test_the_python_blocks_run_as_a_program(capsys):
    run_blocks(PAGE)
    assert "my-pendulum" in capsys.readouterr().out


def test_the_python_blocks_run(namespace):
    run = namespace["run"]
    assert run.t[-1] == pytest.approx(10) and len(run.x) == 1001
    assert len(run.iterations) == 1001


@pytest.mark.slow
def test_the_rule_of_the_readme_passes_what_it_claims(namespace):
    """The example is an honest one: its declared order is the measured one, on every groupoid."""
    from discmech import check

    found = check(
        "order", [namespace["mine"], "heavy-top"], [namespace["two_thirds"]], [50], steps=64
    )
    assert found["verdict"] == "pass", [c["reason"] for c in found["cases"]]


def test_the_targets_of_make_exist():
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    named = {word for line, _ in commands(PAGE, "make") for word in line[1:]}
    named |= set(re.findall(r"`make ([a-z-]+)`", TEXT))
    assert {"report", "test"} <= named
    for target in named:
        assert re.search(rf"^{target}:", makefile, re.M), target


def test_every_link_and_folder_is_there():
    links = re.findall(r"\]\((?!https?:)([^)#]+)\)", TEXT)
    folders = re.findall(r"`([a-z][\w/]*/)`", TEXT)
    assert "NOTATION.md" in links and "integrators/" in folders
    missing = [
        name
        for name in (*links, *folders)
        if not any((ROOT / top / name).exists() for top in ("", "studies", "tests"))
    ]
    assert not missing


def test_it_is_read_in_three_minutes():
    """At 250 words a minute, with the code."""
    assert len(TEXT.split()) <= 750


def test_its_studies_are_the_bench_s_first():
    from discmech.studies import NAMES

    table = re.findall(r"^\| ([a-z-]+) \|", TEXT, re.M)
    assert set(table) - {"study", "folder"} <= set(NAMES)
