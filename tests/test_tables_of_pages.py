"""Every table of every page is a table when it is rendered, with a cell for each head."""

from __future__ import annotations

import re

import pytest
from markdown_it import MarkdownIt
from markdown_it.rules_block.table import escapedSplit

from tests.imports import ROOT
from tests.pages import PAGES

MARKDOWN = MarkdownIt("commonmark").enable("table")
ALL = [
    *PAGES,
    *(ROOT / f"{name}.md" for name in ("CONTRIBUTING", "NOTATION", "PAPER", "CHANGELOG")),
]


def cut_rows(text: str) -> list[str]:
    """Return the rows that do not have a cell for each head, and those that are in no table."""
    lines, found, within = text.splitlines(), [], False
    for token in MARKDOWN.parse(text):
        within = token.type == "table_open" or (within and token.type != "table_close")
        if token.type == "table_open":
            rows = [line.strip().strip("|") for line in lines[slice(*token.map)]]
            found += [row for row in rows if len(escapedSplit(row)) != len(escapedSplit(rows[0]))]
        elif token.type == "inline" and not within:  # a head without its line is a paragraph
            found += [line for line in token.content.splitlines() if re.fullmatch(r"\|.*\|", line)]
    return found


@pytest.mark.parametrize("page", ALL, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_each_row_of_a_table_has_a_cell_for_each_head(page):
    assert not cut_rows(page.read_text("utf-8"))


@pytest.mark.parametrize("text", [
    "| a | b | c |\n|---|---|\n| 1 | 2 |\n", "| a | b |\n|---|---|\n| |x| | 2 |\n",
    "| a | b |\n|---|---|\n| 1 |\n", "| a | b |\n|---|---|\n| `x|y` | 2 |\n",
])  # fmt: skip
def test_a_table_that_is_none_is_noticed(text):
    assert cut_rows(text)


def test_a_bar_in_a_cell_is_escaped():
    assert not cut_rows("| a | b |\n|---|---|\n| \\|x\\| | `y` |\n")
