"""PAPER.md says what the table says, and the table has every displayed formula."""

import hashlib
import os
import re
from collections import Counter
from pathlib import Path

import pytest

from .misprints import FORMULA
from .page import page
from .rows import DEFINITION
from .statements import DIGEST, STATEMENTS
from .table import DISPLAYS, MISPRINTS, ROWS, SECTIONS, displays_of

ROOT = Path(__file__).resolve().parent.parent.parent
TAGS = {m.tag for m in MISPRINTS}

#: displayed formulas a section, counted in the printed paper
COUNTS = {
    "2.1": 10, "2.2": 4, "2.3": 7, "2.4": 1, "2.5": 3, "3.2": 12, "3.3": 4, "3.5": 10,
    "3.6.1": 10, "3.6.2": 11, "3.7": 14,
    "4.1": 5, "4.2": 18, "4.3": 1,
}  # fmt: skip


def test_the_page_is_up_to_date():
    assert (ROOT / "PAPER.md").read_text(encoding="utf-8") == page(), "say: make paper"


def test_no_display_is_without_a_row():
    places = Counter(row.place for row in ROWS)
    assert {d.place for d in DISPLAYS} <= set(places)
    assert not [place for place, count in places.items() if count > 1]
    text = [row.place for row in ROWS if row.place not in {d.place for d in DISPLAYS}]
    assert all(re.fullmatch(r"[234](\.\d)+-[A-Za-z]+( \d\.\d+)?", place) for place in text)


def test_the_displays_are_all_there():
    assert Counter(d.place.partition("-")[0] for d in DISPLAYS) == COUNTS
    numbers = [n for d in DISPLAYS for n in d.number.split("–") if n]
    assert numbers == [str(n + 1) for n in range(41)]
    assert len({d.fingerprint for d in DISPLAYS}) == len(DISPLAYS)
    sections = [d.place.partition("-")[0] for d in DISPLAYS]
    assert sections == sorted(sections, key=list(SECTIONS).index)


@pytest.mark.skipif("DISCMECH_PAPER" not in os.environ, reason="DISCMECH_PAPER is not set")
def test_the_displays_are_those_of_the_source():
    """With DISCMECH_PAPER the path of the paper's TeX source."""
    source = Path(os.environ["DISCMECH_PAPER"])
    assert displays_of(source.read_text(encoding="latin-1")) == DISPLAYS
    assert hashlib.sha256(source.read_bytes()).hexdigest() == DIGEST


def test_a_display_that_is_added_or_changed_would_be_noticed():
    tex = r"\section{One}\section{Two}\subsection{a}\begin{equation}\label{k}a=b\end{equation}\[c\]"
    equation, other = displays_of(tex)
    assert (equation.place, equation.number, equation.label) == ("2.1-1", "1", "k")
    assert (other.place, other.number, other.form) == ("2.1-2", "", "[]")
    assert displays_of(tex.replace("a=b", "a=-b"))[0].fingerprint != equation.fingerprint
    assert displays_of(tex.replace("a=b", "a =\n b"))[0].fingerprint == equation.fingerprint


def test_rows_stand_in_the_order_of_the_paper():
    displayed = {d.place: index for index, d in enumerate(DISPLAYS)}
    order = [displayed[row.place] for row in ROWS if row.place in displayed]
    assert order == sorted(order)
    assert {row.section for row in ROWS} <= set(SECTIONS)


def test_definitions_are_few_and_check_nothing():
    assert all((row.check is None) == (row.how == DEFINITION) for row in ROWS)
    assert sum(row.how == DEFINITION for row in ROWS) < len(ROWS) / 4


def test_every_statement_has_rows_tests_and_a_module():
    places = {row.place: row for row in ROWS}
    for statement in STATEMENTS:
        assert statement.rows and all(places[p].how != DEFINITION for p in statement.rows)
        assert all((ROOT / path).is_file() for path in (*statement.tests, *statement.modules))
    named = {place.partition("-")[2] for place in places if re.search(r" \d\.\d+$", place)}
    assert named <= {statement.name for statement in STATEMENTS}


def test_every_misprint_has_its_row_and_every_tag_its_misprint():
    used = {tag for row in ROWS for tag in row.misprints}
    assert used == {m.tag for m in MISPRINTS if not m.where}
    marked = set[str]()
    for path in (*ROOT.glob("integrators/**/*.py"), *ROOT.glob("tests/**/*.py")):
        marked |= set(re.findall(r"\[misprint: ([\w-]+)\]", path.read_text(encoding="utf-8")))
    formulas = {m.tag for m in MISPRINTS if m.kind == FORMULA}
    assert formulas <= marked - {"tag"} <= TAGS  # "tag" is in the words that explain the marks
    assert all(m.then for m in MISPRINTS if m.kind == FORMULA)
    notation = (ROOT / "NOTATION.md").read_text(encoding="utf-8")
    assert set(re.findall(r"\[misprint: ([\w-]+)\]", notation)) <= TAGS | {"tag"}


def test_github_shows_the_mathematics():
    """No bar inside a cell, no backslash before a sign, dollars in pairs."""
    for line in page().splitlines():
        if not line.startswith("| "):
            continue
        assert line.count("$") % 2 == 0
        math = re.findall(r"\$([^$]*)\$", line)
        for formula in math:
            assert formula == formula.strip() and formula
            assert not re.search(r"\\[^a-zA-Z]|[|*<>]", formula), formula
            assert formula.count("{") == formula.count("}")
        assert "\\" not in re.sub(r"\$[^$]*\$", "", line)
        assert line.count("|") in (5, 6, 7)
