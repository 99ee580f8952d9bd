"""The page in a browser: what a reader sees and does, at a desk, on a phone, in the dark, on paper.

A browser that is there draws the page and runs a script of ours in it; what that finds comes back
in the text of the document.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from discmech.studies.core.history import Found
from discmech.studies.report.page import write_report
from tests.studies.as_json import read
from tests.studies.fake_results import equations, results, scenes, spoiled

BROWSER = (
    shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
)
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(BROWSER is None, reason="no chromium on this machine"),
]


def browser(*words: str) -> str:
    assert BROWSER is not None
    quiet = ["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=20000"]
    done = subprocess.run(
        [BROWSER, *quiet, *words], capture_output=True, text=True, timeout=300, check=True
    )
    return done.stdout


def found(page: Path, script: str, *words: str) -> dict[str, object]:
    """What an asynchronous function body in the page returns."""
    asked = page.with_name("asked.html")
    ask = (
        f"<script>(async () => {{ {script} }})().catch((error) => ({{error: String(error)}}))"
        ".then((result) => { const told = document.createElement('pre'); told.id = 'told';"
        "told.textContent = JSON.stringify(result); document.body.append(told); });</script>"
    )
    asked.write_text(page.read_text("utf-8").replace("</body>", ask + "</body>"), "utf-8")
    told = re.search(r'<pre id="told">(.*?)</pre>', browser("--dump-dom", *words, asked.as_uri()))
    assert told is not None
    answer: dict[str, object] = json.loads(told[1].replace("&gt;", ">").replace("&lt;", "<"))
    assert "error" not in answer, answer
    return answer


def width_of(page: Path, width: int, parts: str = "") -> int:
    """How wide a page is in a window of that width; or how far right some of its parts come."""
    frame = page.with_name("frame.html")
    frame.write_text(
        f'<body><iframe src="{page.name}" width="{width}" height="900"></iframe></body>', "utf-8"
    )
    seen = found(frame, """
        await new Promise((done) => setTimeout(done, 2000));
        const root = document.querySelector("iframe").contentDocument.documentElement;
        root.querySelectorAll("details.cases").forEach((e) => (e.open = true));
        const end = (e) => e.getBoundingClientRect().right;
        const right = [...root.querySelectorAll("PARTS")].map(end);
        return {wide: right.length ? Math.ceil(Math.max(...right))
                                   : Math.max(root.scrollWidth, root.offsetWidth)};
    """.replace("PARTS", parts or "none"), "--allow-file-access-from-files")  # fmt: skip
    return int(str(seen["wide"]))


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("good")
    past = [Found("2026-11-20T12:00:00", "abc1234", str(k), "pass") for k in (1, 1, 3, 2)]
    words = (read(*results((16,))), equations(), scenes(), folder / "build")
    return write_report(*words, past=lambda case: past)


@pytest.fixture(scope="module")
def bad(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_report(read(*spoiled()), [], scenes(), tmp_path_factory.mktemp("bad") / "build")


def test_failures_stand_above_what_passes_and_passes_are_folded(bad: Path) -> None:
    seen = found(bad, """
        const top = (e) => e.getBoundingClientRect().top;
        const all = [...document.querySelectorAll("main tr .badge.fail")];
        const bad = all.filter((e) => e.checkVisibility());
        const folded = [...document.querySelectorAll("details.cases")];
        return {shown: bad.length, first: Math.min(...bad.map(top)),
                section: top(document.querySelector("main section")),
                closed: folded.filter((e) => !e.open).length,
                hidden: folded.filter((e) => !e.open).every(
                    (e) => !e.querySelector("td").checkVisibility())};
    """)  # fmt: skip
    assert seen["shown"] and seen["closed"] and seen["hidden"]
    assert float(str(seen["first"])) < float(str(seen["section"]))


def test_a_command_is_copied_and_says_so(good: Path) -> None:
    seen = found(good, """
        const button = document.querySelector("button.copy");
        let copied = "";
        navigator.clipboard
            ? navigator.clipboard.writeText = async (text) => { copied = text; }
            : document.execCommand = () => { copied = document.activeElement.value; };
        button.click();
        await new Promise((done) => setTimeout(done, 100));
        return {visible: button.checkVisibility(), said: button.textContent, copied,
                wanted: button.previousElementSibling.textContent};
    """)  # fmt: skip
    assert seen["visible"] and seen["said"] == "copied"
    assert seen["copied"] == seen["wanted"] != ""


def test_the_number_of_a_mark_is_shown_under_the_pointer(good: Path) -> None:
    seen = found(good, """
        const plot = document.querySelector("svg.plot");
        const mark = plot.querySelector("use:not(.axis *)");
        const corner = new DOMPoint(mark.x.baseVal.value, mark.y.baseVal.value);
        const at = corner.matrixTransform(plot.getScreenCTM());
        const point = (x, y) => plot.dispatchEvent(new PointerEvent(
            "pointermove", {clientX: x, clientY: y, bubbles: true}));
        const reading = document.querySelector("output.reading");
        point(at.x + 1, at.y);
        const near = [reading.checkVisibility(), reading.textContent];
        const edge = plot.getBoundingClientRect();
        point(edge.right - 1, edge.bottom - 1);
        return {near, far: reading.checkVisibility()};
    """)  # fmt: skip
    (visible, text), far = seen["near"], seen["far"]  # type: ignore[misc]
    assert visible and not far
    step, error = map(float, text.split(", "))
    case = results((16,))[0]["cases"][0]
    assert any(
        abs(row["step"] / step - 1) < 0.02 and abs(row["error"] / error - 1) < 0.05
        for other in results((16,))[0]["cases"] if other["scene"] == case["scene"]
        for row in other["rows"]
    )  # fmt: skip


@pytest.mark.parametrize("width", [390, 1280])
def test_nothing_runs_over_the_side(good: Path, bad: Path, width: int) -> None:
    """Nor a verdict in a table, and on a phone no table at all."""
    for page in (good, bad):
        assert width_of(page, width) <= width
        assert width_of(page, width, ".badge" if width > 600 else ".scroll:not(pre) td") <= width


def test_a_line_of_the_last_runs_is_seen_and_says_what_it_is(good: Path) -> None:
    seen = found(good, """
        document.querySelectorAll("details").forEach((e) => (e.open = true));
        const line = document.querySelector("td > svg.past");
        const [box, cell] = [line, line.parentElement].map((e) => e.getBoundingClientRect());
        return {within: box.left > cell.left && box.right <= cell.right, high: box.height,
                beside: Math.abs(box.top - line.previousElementSibling.getBoundingClientRect().top),
                said: line.querySelector("title").textContent};
    """)  # fmt: skip
    assert seen["within"] and 10 < float(str(seen["high"])) < 24 and float(str(seen["beside"])) < 9
    assert str(seen["said"]).startswith("2 in 1 run, since 2026-11-20 (commit abc1234); before: 3")


def test_in_the_dark_words_stand_out_from_the_paper(good: Path) -> None:
    ask = """
        const light = (colour) => colour.match(/[0-9.]+/g).slice(0, 3).reduce((a, b) => a + +b, 0);
        const style = getComputedStyle(document.body);
        const words = getComputedStyle(document.querySelector("svg.plot text")).fill;
        return {dark: matchMedia("(prefers-color-scheme: dark)").matches,
                paper: light(style.backgroundColor), ink: light(style.color), plot: light(words)};
    """
    dark = found(good, ask, "--blink-settings=preferredColorScheme=0")
    plain = found(good, ask, "--blink-settings=preferredColorScheme=1")
    assert dark["dark"] and not plain["dark"]
    for seen, sign in ((dark, 1), (plain, -1)):
        paper, ink, plot = (float(str(seen[k])) for k in ("paper", "ink", "plot"))
        assert sign * (ink - paper) > 300 and sign * (plot - paper) > 200


def test_it_can_be_printed(good: Path) -> None:
    paper = good.with_name("page.pdf")
    browser(f"--print-to-pdf={paper}", good.as_uri())
    assert paper.read_bytes().startswith(b"%PDF") and paper.stat().st_size > 20_000
