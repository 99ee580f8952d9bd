"""The report from made-up results: complete, sound as HTML, whole or not written at all."""

from __future__ import annotations

import csv
import io
import json
import math
import random
import re
import subprocess
import sys
from collections.abc import Callable
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from discmech.studies.report import (
    formulas,
    mathml,
    plot_drift,
    readme_picture,
    tables,
    typeset,
    wording,
)
from discmech.studies.report.alike import Share, shares
from discmech.studies.report.canvas import Panel, Sheet, log_axis, render
from discmech.studies.report.labels import spread
from discmech.studies.report.page import write_report
from discmech.studies.report.palette import Mark
from discmech.studies.report.summary import headline, merged
from discmech.studies.report.svg import inline_panels
from tests.studies.fake_results import MATHML, equations, results, scenes, spoiled


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


@pytest.fixture(scope="module")
def full(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_report(results(), equations(), scenes(), tmp_path_factory.mktemp("r") / "build")


def test_page_is_whole_small_and_self_contained(full: Path) -> None:
    text = full.read_text(encoding="utf-8")
    page = Reader(text)
    assert not page.open
    assert len(page.ids) == len(set(page.ids))
    assert page.used <= set(page.ids)
    assert len(text.encode()) < 3_000_000
    local = [link for link in page.links if link and link != "data:,"]
    assert local and all((full.parent / link).is_file() for link in local)
    assert "All 114 cases pass; all 12 controls were caught." in text
    assert not [entry for entry in full.parent.iterdir() if entry.name.startswith(".")]


def test_no_fixed_colours_in_inline_figures(full: Path) -> None:
    drawings = re.findall(r"<svg class=.*?</svg>", full.read_text(encoding="utf-8"), re.S)
    assert len(drawings) > 30
    assert not any(re.search('#[0-9a-f]{6}[;"]', drawing) for drawing in drawings)
    assert all('aria-label="' in drawing for drawing in drawings)


def test_same_results_give_the_same_files(full: Path, tmp_path: Path) -> None:
    few = [result | {"cases": result["cases"][:3]} for result in results()[:1]]
    pages = [write_report(few, [], scenes(), tmp_path / name) for name in "ab"]
    for name in ("index.html", "figures/order-16.svg", "figures/order-16.png", "tables/order.tex"):
        assert len({(page.parent / name).read_bytes() for page in pages}) == 1


def test_whatever_went_wrong_is_said_first(tmp_path: Path) -> None:
    text = write_report(spoiled(), [], scenes(), tmp_path).read_text(encoding="utf-8")
    assert "2 of 38 cases fail; 1 is inconclusive; 5 of 6 controls were caught." in text
    assert text.index("FL is singular") < text.index("cases pass</summary>")
    assert text.index('fail">missed') < text.index("cases pass</summary>")
    assert "&lt;b&gt;" in text and "two &amp; a_half" in text and "nan" not in text.lower().split()
    assert not Reader(text).open
    strict = json.loads((tmp_path / "tables/twist.json").read_text(), parse_constant=pytest.fail)
    assert strict["cases"][0]["measured"]["gap"] == [0.5, None]
    assert r"two \& a\_half" in (tmp_path / "tables/twist.tex").read_text()


def test_nothing_at_all_is_a_page_too(tmp_path: Path) -> None:
    assert "Nothing was measured." in write_report([], [], [], tmp_path).read_text()


def test_a_failure_leaves_the_old_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    few = [results((16,))[2] | {"cases": []}]
    page = write_report(few, [], [], tmp_path)
    (tmp_path / "kept.json").write_text("{}")
    before = contents(tmp_path)
    monkeypatch.setattr("discmech.studies.report.page.machine", lambda _: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_report(results((16,))[:1], [], [], tmp_path)
    assert page.exists() and before == contents(tmp_path)


def test_tables_keep_all_digits_and_all_rows(full: Path) -> None:
    order = results()[0]
    folder = full.parent / "tables"
    with (folder / "order.csv").open(encoding="utf-8") as stream:
        lines = list(csv.DictReader(stream))
    assert len(lines) == 36
    assert float(lines[5]["measured.order"]) == order["cases"][5]["measured"]["order"]
    with (folder / "order-rows.csv").open(encoding="utf-8") as stream:
        assert len(list(csv.DictReader(stream))) == sum(len(c["rows"]) for c in order["cases"])
    text = (folder / "momentum.tex").read_text(encoding="utf-8")
    assert text.isascii() and r"\toprule" in text and r"$\mu\cdot\Gamma$" in text


def test_terminal_table_ends_with_the_failures() -> None:
    from rich.console import Console

    console = Console(width=150, file=io.StringIO())
    with console.capture() as capture:
        tables.print_result(console, spoiled()[0])
    shown = capture.get()
    assert shown.index("inconclusive") < shown.index("Newton stopped") > shown.rindex("2.00")


def test_terminal_summary_has_a_line_a_study_and_the_cases_that_did_not_pass() -> None:
    from rich.console import Console

    from discmech.studies.report.summary import merged, print_summary

    console = Console(width=150, file=io.StringIO())
    with console.capture() as capture:
        print_summary(console, spoiled())
    shown = capture.get()
    cases = [case for study in merged(spoiled()) for case in study["cases"]]
    bad = [case for case in cases if case["verdict"] != "pass"]
    assert bad and shown.count("\n  discmech ") == len(bad)
    assert all(case["command"] in shown and case["reason"] in shown for case in bad)
    assert len(shown.splitlines()) < 8 + len(spoiled()) + 2 * len(bad)


@pytest.mark.parametrize(
    ("value", "interval", "text"),
    [
        (2.0004, [1.998, 2.002], "2.000 ± 0.003"),
        (2.0, [2.0, 2.0], "2.000000 ± 0.000001"),
        (1.98765, [1.90, 2.05], "1.988 ± 0.088"),
        (2.00001234, [2.00001, 2.00002], "2.000012 ± 0.000008"),
        (1.5, None, "1.500"),
        (1.07e-11, [-2.28e-9, 2.30e-9], "(0.0 ± 2.3)×10⁻⁹"),
        (-2.6808971e-18, [-2.6810207e-18, -2.6807736e-18], "(−2.6809 ± 0.0002)×10⁻¹⁸"),
        (-9e-10, [-9.9e-10, -8.9e-10], "(−9.0 ± 0.9)×10⁻¹⁰"),
        (0.0, [0.0, 0.0], "0"),
        (None, [0, 1], "—"),
        (math.nan, [0, 1], "—"),
    ],
)
def test_orders_have_the_digits_they_deserve(value: Any, interval: Any, text: str) -> None:
    assert wording.plus_minus(value, interval) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(3.14e-16, "3.1×10⁻¹⁶"), (1e-13, "10⁻¹³"), (0, "0"), ("2e-60", "2.0×10⁻⁶⁰"), (None, "—")],
)
def test_small_numbers(value: Any, text: str) -> None:
    assert wording.scientific(value) == text


def test_words_for_latex() -> None:
    assert typeset.tex("≤ 3.1×10⁻¹⁶, |Γ|²") == r"$\le$ $3.1\times 10^{-16}$, $|\Gamma|^{2}$"
    assert typeset.tex("50 % of a_b, 3×2") == r"50 \% of a\_b, 3$\times$2"


def test_several_results_of_one_study_are_one() -> None:
    both = [*results((16,))[:1], *results((50,))[:1]]
    both[1]["verdict"] = "fail"
    (whole,) = merged(both)
    assert len(whole["cases"]) == 36 and whole["verdict"] == "fail"
    assert headline([whole])["verdict"] == "fail"


@pytest.mark.parametrize(
    ("verdicts", "controls", "text"),
    [
        (["pass"], [], "The only case passes."),
        (["fail", "pass"], ["pass"], "1 of 2 cases fails; the only control was caught."),
        (["inconclusive"] * 2, [], "All 2 cases are inconclusive."),
        (["fail"] * 2 + ["inconclusive"], [], "2 of 3 cases fail; 1 is inconclusive."),
        ([], ["pass", "fail", "fail"], "1 of 3 controls was caught."),
        ([], ["fail", "fail"], "None of 2 controls were caught."),
    ],
)
def test_headline_is_english(verdicts: list[str], controls: list[str], text: str) -> None:
    cases = [{"verdict": word} for word in verdicts]
    cases += [{"verdict": word, "control": True} for word in controls]
    assert headline([{"study": "order", "verdict": "pass", "cases": cases}])["text"] == text


def test_only_the_quantity_that_drifts_is_said_to_fail() -> None:
    case = {"rule": "midpoint", "verdict": "fail", "expected": {"limit": 1e-12}}
    case["measured"] = {"drift": {"μ₃": 0.0, "|Γ|²": 2e-12}}
    assert plot_drift.drifted(case, "|Γ|²") == "midpoint  2×10⁻¹²\n(fail)"
    assert plot_drift.drifted(case, "μ₃") == "midpoint  0"
    assert plot_drift.drifted(case | {"measured": {}}, "μ₃") == "midpoint\n(fail)"


def test_curves_that_coincide_share_a_line() -> None:
    from matplotlib.figure import Figure

    axes = Figure().add_subplot()
    axes.set(xscale="log", yscale="log", xlim=(1, 100), ylim=(1e-9, 1))
    line = [(float(x), x**-2.0) for x in range(1, 50)]
    near = [(x, 1.02 * y) for x, y in line]
    far = [(x, 4 * y) for x, y in line]
    assert shares(axes, [line, far, near, []]) == [Share(0, 2), Share(), Share(1, 2), Share()]
    styles = [share.line(Mark("#000000", "o"), 1.0) for share in (Share(0, 2), Share(1, 2))]
    assert styles[0]["ls"] == "-" and styles[1]["ls"][1][0] < sum(styles[1]["ls"][1])


def test_labels_keep_apart() -> None:
    found = spread([10, 11, 12, 50], [8] * 4, 0, 60)
    assert found == [3, 11, 19, 50]
    assert spread([10, 10, 58], [8, 16, 8], 0, 60) == [4, 16, 58]
    assert spread([], [], 0, 60) == []
    assert min(b - a for a, b in pairwise(found)) >= 8


def test_only_presentation_mathml_reaches_the_page() -> None:
    assert "<mo>(</mo><mi>μ</mi><mo>)</mo>" in mathml.display(MATHML)
    assert mathml.display("<mi onclick='x()'>a</mi>") == '<math display="block"><mi>a</mi></math>'
    assert "<script" not in mathml.display("<script>alert(1)</script>")
    assert "<code>" in mathml.display("<mi>")


def words(formula: str) -> str:
    """A formula's letters, a times sign as a space."""
    return re.sub("<[^>]*>", "", formula).replace("&#8290;", " ")


def test_formulas_are_collected_and_stay_exact() -> None:
    from sympy import Rational, cancel, symbols

    h, a, b, u, w, x, z = symbols("h a b u w x z")
    square = h**2 * u**2 + 16
    body = a * u * (h**2 * u**2 / 4 + 1) + b * w * (h**2 * u * w / 4 - h * u / 2)
    force = -8 * h * b * (u * z - w * x) / square + h**3 * u * b * x * z / (2 * square)
    named: dict[Any, Any] = {}
    terms = formulas.ascending(body + force, h, {x, z}, named)
    assert cancel(sum(terms).xreplace(named) - body - force) == 0
    assert [*named.values()] == [square]
    assert cancel(sum(formulas.ascending(body + force, h, {x, z})) - body - force) == 0
    letters = {u: "u_1", w: "u_2", next(iter(named)): "Δ(u)"}
    shown = formulas.Typesetter(letters, h, [u, w, x, z]).equation([u], terms)
    assert words(shown) == (
        "u1=a u1−h b u1 u22+h2 u14 (a u12+b u22)+8 h bΔ(u) (u2 x−u1 z)+h3 b u1 x z2 Δ(u)"
    )
    apart = ((x - z) ** 2 + (u - w) ** 2) ** Rational(-3, 2)
    terms = formulas.ascending(a * u + h * b * (x - z) * apart, h, {x, z})
    assert terms[-1].has(apart) and cancel(sum(terms) - a * u - h * b * (x - z) * apart) == 0
    minus = formulas.Typesetter({}, h, [u]).sum([-(a + b), -(a - b) / 2, u ** (a / 2)])
    assert words(minus).startswith("−a−b") or words(minus).startswith("−(a+b)")


def test_equations_of_a_scheme_are_typeset() -> None:
    from discmech.integrators import Scheme, scenes
    from discmech.integrators import rules as discretisations
    from discmech.studies.command.equations import equations_of

    for scene, lines in (("kepler", 2), ("rigid-body", 3)):
        found = equations_of(Scheme(scenes.get(scene), discretisations.midpoint))
        assert len(found["residual_mathml"]) == len(found["momentum_mathml"]) == lines
        for key in ("residual_mathml", "momentum_mathml", "points_mathml"):
            for formula in found[key]:
                assert mathml.display(formula).startswith("<math")
                assert not re.search("_|after|z0", words(formula))
    held = equations_of(Scheme(scenes.get("suslov"), discretisations.midpoint))
    assert words(held["constraints_mathml"][0]) == "u3=0"
    assert words(held["constrained_momentum_mathml"][2]).startswith("μ3+h λ2=")
    assert words(held["constrained_residual_mathml"][0]).endswith("=μ′1")
    assert words(found["residual_mathml"][2]).startswith(
        "inertia3 u3+h u1 u22 (inertia1−inertia2)+"
    )


def test_picture_of_the_readme(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from PIL import Image

    tables.write_tables(results((16,))[0], tmp_path / "tables")
    file = tmp_path / "docs" / "picture.png"
    assert readme_picture.main([str(tmp_path), str(file)]) == 0
    assert file.stat().st_size < 150_000
    assert Image.open(file).convert("RGB").getpixel((0, 0)) == (255, 255, 255)
    assert readme_picture.main([str(tmp_path / "nowhere")]) == 2
    assert "make report" in capsys.readouterr().err


def test_import_is_light() -> None:
    code = "import sys; from discmech.studies.report import page, tables; print(*sys.modules)"
    root = Path(__file__).resolve().parents[2]
    run = subprocess.run(
        [sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True
    )
    heavy = {"matplotlib", "numpy", "jinja2", "sympy", "numba", "rich"}
    assert not heavy & set(run.stdout.split())


def panel(draw: Callable[[Axes], None]) -> tuple[str, dict[str, str]]:
    library: dict[str, str] = {}
    drawing = render([Panel("in R⁴", "10⁻⁵ of |μ₃|", "x", "a", draw)], Sheet(), library)
    return drawing.panels[0], library


def test_marks_keep_their_numbers_and_ticks_are_no_marks() -> None:
    points = [(0.5, 1e-3), (2.0, 3e-7), (7.25, 1e-9)]

    def draw(axes: Axes) -> None:
        log_axis(axes, "x", (0.1, 10))
        log_axis(axes, "y", (1e-10, 1))
        axes.plot(*zip(*points, strict=True), marker="o", color="#0072b2")

    shown, library = panel(draw)
    ends = re.search(r'data-axes="([^"]*)"', shown)
    (places,) = re.findall(r'<path class="\S+ marks" d="([^"]*)"/>', shown)
    assert ends and any("var(--blue)" in shape for shape in library.values() if "<marker" in shape)
    found = [[float(n) for n in pair.split()] for pair in places.strip("M").split("M")]
    for place, point in zip(found, points, strict=True):
        for at, wanted, (first, last, low, high, log) in zip(
            place, point, json.loads(ends[1]), strict=True
        ):
            assert log
            value = low * (high / low) ** ((at - first) / (last - first))
            assert value == pytest.approx(wanted, rel=2e-3)


def test_lines_are_true_to_a_tenth_of_a_point() -> None:
    chance = random.Random(5)
    x = sorted(chance.random() for _ in range(200))
    y = [chance.random() / 2 + k % 2 / 2 for k in range(len(x))]  # no two steps go one way

    def draw(axes: Axes) -> None:
        axes.set(xlim=(0, 1), ylim=(0, 1))
        axes.plot(x, y, color="#d55e00")

    shown, library = panel(draw)
    (name,) = (k for k, style in library.items() if "vermillion" in style and "<style" in style)
    (route,) = re.findall(rf'class="{name}" d="M([^"]*)"', shown)
    steps = re.findall(r"[lhv]|-?[\d.]+", route)
    ends = re.search(r'data-axes="([^"]*)"', shown)
    assert ends
    (left, right, *_), (low, high, *_) = json.loads(ends[1])
    at = [float(steps.pop(0)), float(steps.pop(0))]
    corners, way = [tuple(at)], "l"
    while steps:
        way = steps.pop(0) if steps[0] in "lhv" else way
        for axis in {"l": (0, 1), "h": (0,), "v": (1,)}[way]:
            at[axis] += float(steps.pop(0))
        corners.append(tuple(at))
    for a, b in zip(x, y, strict=True):
        wanted = (left + a * (right - left), low + b * (high - low))
        assert min(math.dist(wanted, corner) for corner in corners) < 0.08


def test_words_of_a_figure_reach_the_page_in_one_piece() -> None:
    shown, _ = panel(lambda axes: log_axis(axes, "y", (1e-5, 8e-5)))
    words = [re.sub("<[^>]*>", "", t) for t in re.findall("<text.*?</text>", shown)]
    assert {"in R4", "10−5 of \u2009|\u2009μ3\u2009|\u2009", "10−5", "2×10−5"} <= set(words)
    assert "transform" not in shown


@pytest.mark.parametrize("words", ["2×10⁻⁵", "|Γ|²", "μ₁²/4 + μ₂μ₃", "5 $ \\ 10⁻³", "plain"])
def test_mathematics_of_a_figure_becomes_its_words_again(words: str) -> None:
    again = typeset.page_text(typeset.figure_text(words))
    assert again.replace("\u2009", "") == words
    assert typeset.page_text(r"$\frac{1}{2}$") == r"$\frac{1}{2}$"


def test_a_raised_letter_stays_in_its_place_in_a_title() -> None:
    figure = Figure(figsize=(4, 3))
    figure.add_subplot().set_title("Free body in R$^{4}$ (Manakov)")
    drawn = io.BytesIO()
    with rc_context({"svg.fonttype": "none"}):
        figure.savefig(drawn, format="svg")
    (panel,) = inline_panels(drawn.getvalue(), [(0, 0, 288, 216)], ["a body"], ["{}"], {})
    assert "Free body in R4 (Manakov)" in re.sub("<[^>]*>", "", panel).replace("\xa0", " ")
