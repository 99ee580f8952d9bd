"""The report from made-up results: complete, sound as HTML, whole or not written at all."""

from __future__ import annotations

import csv
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from discmech.studies.core.ours import MANIFEST
from discmech.studies.report import tables
from discmech.studies.report.page import About, write_report
from discmech.studies.report.summary import headline, merged, trouble
from tests import readme_picture
from tests.studies.as_json import read
from tests.studies.fake_results import case, equations, results, scenes, spoiled


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


class Reader(HTMLParser):
    """Ids, references and balance of a page."""

    void = frozenset({"meta", "link", "br", "hr", "img", "input", "wbr"})

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.used: set[str] = set(re.findall(r"url\(#([^)]+)\)", text))
        self.links: list[str] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.ids += filter(None, [values.get("id")])
        for key in ("href", "src"):
            address = values.get(key) or ""
            (self.used.add(address[1:]) if address.startswith("#") else self.links.append(address))
        if tag not in self.void:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


FEW = ("kepler", "heavy-top")


def drawn() -> list[dict[str, Any]]:
    """Results of every study on two scenes, of one at two precisions; all are drawn alike."""
    order, *others = results((16,))
    both = [order | {"cases": order["cases"] + results((50,))[0]["cases"]}, *others]
    return [r | {"cases": [c for c in r["cases"] if c["scene"] in FEW]} for r in both]


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_report(
        read(*drawn()), equations(), scenes(), tmp_path_factory.mktemp("r") / "build",
        about=About("Report", whole=True),
    )  # fmt: skip


def test_page_is_whole_small_and_self_contained(full: Path) -> None:
    text = full.read_text(encoding="utf-8")
    page = Reader(text)
    assert not page.open
    assert len(page.ids) == len(set(page.ids))
    assert page.used <= set(page.ids)
    assert len(text.encode()) < 3_000_000
    local = [link for link in page.links if link and link != "data:,"]
    assert local and all((full.parent / link).is_file() for link in local)
    assert "All 30 cases pass; all 4 controls were caught." in text
    assert {file.suffix for file in (full.parent / "figures").iterdir()} == {".svg"}
    assert "PDF and PNG: the command with --folder DIR" in text
    hidden = [entry.name for entry in full.parent.iterdir() if entry.name.startswith(".")]
    assert hidden == [MANIFEST]  # no draft is left


def test_no_fixed_colours_in_inline_figures(full: Path) -> None:
    drawings = re.findall(r"<svg class=.*?</svg>", full.read_text(encoding="utf-8"), re.S)
    assert len(drawings) > 10
    assert not any(re.search('#[0-9a-f]{6}[;"]', drawing) for drawing in drawings)
    assert all('aria-label="' in drawing for drawing in drawings)


@pytest.mark.slow
def test_same_results_give_the_same_files(full: Path, tmp_path: Path) -> None:
    few = [result | {"cases": result["cases"][:3]} for result in results()[:1]]
    pages = [write_report(read(*few), [], scenes(), tmp_path / name) for name in "ab"]
    for name in ("index.html", "figures/order-16.svg", "figures/order-16.png", "tables/order.tex"):
        assert len({(page.parent / name).read_bytes() for page in pages}) == 1


def test_whatever_went_wrong_is_said_first(tmp_path: Path) -> None:
    text = write_report(read(*spoiled()), [], scenes(), tmp_path).read_text(encoding="utf-8")
    assert "2 of 38 cases fail; 1 is inconclusive; 5 of 6 controls were caught." in text
    assert text.index("FL is singular") < text.index("cases pass</summary>")
    assert text.index('fail">missed') < text.index("cases pass</summary>")
    assert "&lt;b&gt;" in text and "two &amp; a_half" in text and "nan" not in text.lower().split()
    assert not Reader(text).open
    strict = json.loads((tmp_path / "tables/twist.json").read_text(), parse_constant=pytest.fail)
    assert strict["cases"][0]["measured"]["gap"] == [0.5, None]
    assert r"two \& a\_half" in (tmp_path / "tables/twist.tex").read_text()


@pytest.mark.parametrize("said", ["pass", "inconclusive", "fail"])
@pytest.mark.parametrize("kind", ["peer", "rule"])
def test_other_people_s_methods_stand_apart(kind: str, said: str, tmp_path: Path) -> None:
    """Their verdicts are not in the headline, so they are not among what did not pass."""
    one = case("work-precision", "kepler", "Radau", 16, kind=kind, verdict=said, reason="too few")
    study = {"study": "work-precision", "verdict": "pass", "cases": [one]}
    assert bool(trouble(merged(read(study)))) is (kind == "rule" and said != "pass")
    text = write_report(read(study), [], [], tmp_path).read_text(encoding="utf-8")
    assert ("Other people's methods: 1" in text) is (kind == "peer") and "Radau" in text
    assert ('cases" open' in text) is (kind == "peer" and said == "fail")


def test_nothing_at_all_is_a_page_too(tmp_path: Path) -> None:
    assert "Nothing was measured." in write_report([], [], [], tmp_path).read_text()


def test_a_failure_leaves_the_old_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    order, _, none, _ = results((16,))
    few = [none | {"cases": []}]
    page = write_report(read(*few), [], [], tmp_path)
    (tmp_path / "kept.json").write_text("{}")
    before = contents(tmp_path)
    monkeypatch.setattr("discmech.studies.report.page.machine", lambda _: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_report(read(order | {"cases": order["cases"][:2]}), [], [], tmp_path)
    assert page.exists() and before == contents(tmp_path)


def test_tables_keep_all_digits_and_all_rows(full: Path) -> None:
    order = drawn()[0]
    folder = full.parent / "tables"
    with (folder / "order.csv").open(encoding="utf-8") as stream:
        lines = list(csv.DictReader(stream))
    assert len(lines) == 12
    assert float(lines[5]["measured.order"]) == order["cases"][5]["measured"]["order"]
    with (folder / "order-rows.csv").open(encoding="utf-8") as stream:
        assert len(list(csv.DictReader(stream))) == sum(len(c["rows"]) for c in order["cases"])
    text = (folder / "momentum.tex").read_text(encoding="utf-8")
    assert text.isascii() and r"\toprule" in text and r"$\mu\cdot\Gamma$" in text


def test_several_results_of_one_study_are_one() -> None:
    both = [*results((16,))[:1], *results((50,))[:1]]
    both[1]["verdict"] = "fail"
    (whole,) = merged(read(*both))
    assert len(whole.cases) == 36 and whole.verdict == "fail"
    assert headline([whole])["verdict"] == "fail"


@pytest.mark.slow
def test_picture_of_the_readme(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from PIL import Image

    tables.write_tables(read(*results((16,)))[0], tmp_path / "tables")
    file = tmp_path / "docs" / "picture.png"
    assert readme_picture.main([str(tmp_path), str(file)]) == 0
    assert file.stat().st_size < 150_000
    assert Image.open(file).convert("RGB").getpixel((0, 0)) == (255, 255, 255)
    assert readme_picture.main([str(tmp_path / "nowhere")]) == 2
    assert "make report" in capsys.readouterr().err
