"""Code in the pages: its blocks, the files that they show, the commands."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

from tests.imports import ROOT

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("[!_]*.md"))]


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text("utf-8"), re.M | re.S)


def in_order(page: Path) -> list[tuple[str, str]]:
    """(language, text) of every block."""
    return re.findall(r"^```(\w+)\n(.*?)^```", page.read_text("utf-8"), re.M | re.S)


def commands(page: Path, first: str) -> list[tuple[list[str], int]]:
    """`command_lines` of all of a page's blocks."""
    return [found for block in blocks(page, "sh") for found in command_lines(block, first)]


def command_lines(block: str, first: str) -> list[tuple[list[str], int]]:
    """(words, exit code) of the lines that begin with a word; the code stands in a comment."""
    lines = block.replace("\\\n", " ").splitlines()
    told = [
        (shlex.split(line, comments=True), re.search(r"# exit code (\d)", line)) for line in lines
    ]
    return [(words, int(code[1]) if code else 0) for words, code in told if words[:1] == [first]]


def files(page: Path) -> dict[str, str]:
    """{name: text} of the blocks that begin with a comment which is a file's name."""
    named = ((re.match(r"# ([\w/]+\.py)\n", b), b) for b in blocks(page, "python"))
    return {name[1]: block for name, block in named if name}


def write_files(page: Path, folder: Path) -> None:
    for name, text in files(page).items():
        folder.joinpath(name).write_text(text, "utf-8")


def run_blocks(page: Path, name: str = "__main__") -> dict[str, object]:
    """What the Python blocks define, run in one namespace, in order; files are only imported."""
    found: dict[str, object] = {"__name__": name}
    shown = set(files(page).values())
    for number, block in enumerate(blocks(page, "python"), 1):
        if block not in shown:
            exec(compile(block, f"{page.name}, block {number}", "exec"), found)
    return found
