"""What the pages show runs, what they link is there, and the site is built of them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import discmech
from tests.imports import ROOT
from tests.pages import PAGES, blocks, commands, files, run_blocks, write_files
from tests.studies.test_browser import BROWSER, width_of

#: pages whose Python blocks take more than a few seconds
SLOW = {"rules.md", "symmetries.md", "tutorial.md", "one-step-maps.md", "lattices.md",
        "body-in-space.md", "degenerate.md"}  # fmt: skip


def label(page):
    return page.relative_to(ROOT).as_posix()


def those_with(found, slow=()):
    """The pages for which something is found, those of `slow` marked so."""
    marks = {name: [pytest.mark.slow] for name in slow}
    return [pytest.param(p, id=label(p), marks=marks.get(p.name, ())) for p in PAGES if found(p)]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder to run a page in; what was imported from it is forgotten."""
    before = set(sys.modules)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield tmp_path
    for name in set(sys.modules) - before:
        if str(getattr(sys.modules[name], "__file__", "")).startswith(str(tmp_path)):
            del sys.modules[name]


@pytest.mark.dear(but=("you-", "to/take", "control.md", "docs/single", "to/pytest.md",
                       "to/studies.md", "docs/derivatives.md"))  # fmt: skip
@pytest.mark.parametrize("page", those_with(
    lambda page: "docs" in page.parts and blocks(page, "python"), SLOW))  # fmt: skip
def test_python_blocks_run(page, folder, capsys):
    write_files(page, folder)
    run_blocks(page)


@pytest.mark.parametrize("page", those_with(lambda page: commands(page, "discmech")))
def test_commands_parse(page, folder):
    from discmech.studies.command.entry import _parser
    from discmech.studies.command.options import choice_of

    write_files(page, folder)
    if page.name == "README.md":
        (folder / "examples").symlink_to(ROOT / "examples")
    for words, _ in commands(page, "discmech"):
        options = _parser().parse_args(words[1:])
        if hasattr(options, "own") and hasattr(options, "scenes"):
            choice_of(options)  # names, digits and steps are known


@pytest.mark.slow
@pytest.mark.parametrize("page", those_with(
    lambda page: page.parent.name in ("docs", "how-to")  # a study's page shows one of minutes
    and page.name != "commands.md"  # as does the list of all commands
    and (commands(page, "discmech") or commands(page, "pytest"))))  # fmt: skip
def test_commands_run(page, folder):
    """In a folder that holds the page's files and nothing else, the plugin by its entry point."""
    write_files(page, folder)
    programs = {"discmech": ("discmech.studies.command",), "pytest": ("pytest",)}
    clean = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST")}
    for first, module in programs.items():
        for words, code in commands(page, first):
            line = [sys.executable, "-m", *module, *words[1:]]
            done = subprocess.run(
                line, cwd=folder, env=clean, capture_output=True, text=True, timeout=600
            )
            assert done.returncode == code, done.stdout + done.stderr
    tables = folder / "figure" / "tables"
    assert page.name != "tutorial.md" or tables.joinpath("order.tex").read_text().count("toprule")


@pytest.mark.parametrize("page", those_with(lambda page: True))
def test_links_lead_somewhere(page):
    links = re.findall(r"\]\((?!https?:)([^)#]+)\)", page.read_text("utf-8"))
    assert not [link for link in links if not (page.parent / link).exists()]


def test_the_reference_has_every_public_name():
    shown = (ROOT / "docs" / "reference.md").read_text("utf-8")
    assert not [name for name in discmech.__all__ if not re.search(rf"\b{name}\b", shown)]


def test_files_of_a_page_are_told_by_their_first_line():
    assert set(files(ROOT / "docs" / "tutorial.md")) == {"mine.py", "wrong.py"}


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    pytest.importorskip("furo", reason="`make docs` installs what builds the site")
    built = tmp_path_factory.mktemp("site")
    done = subprocess.run([sys.executable, "-m", "sphinx", "-q", "-E", "-W", "--keep-going", "-c",
                           "docs", ".", str(built)],
                          cwd=ROOT, capture_output=True, text=True, timeout=600)  # fmt: skip
    assert done.returncode == 0, done.stderr
    return built


@pytest.mark.slow
def test_the_site_has_every_page(site):
    pages = {label(page).replace(".md", ".html") for page in PAGES} - {"README.html"}
    assert not [page for page in pages if not (site / page).is_file()]
    assert 'url=docs/index.html"' in (site / "index.html").read_text("utf-8")


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="no chromium on this machine")
@pytest.mark.parametrize("width", [390, 1400])
@pytest.mark.parametrize("page", ["index", "tutorial", "reference"])
def test_nothing_of_the_site_runs_over_the_side(site: Path, page: str, width: int):
    assert width_of(site / "docs" / f"{page}.html", width) <= width
