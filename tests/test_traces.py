"""What is committed holds no trace of anybody's machine, and nothing that was generated."""

import re
import subprocess

import pytest

from tests.imports import ROOT


def tracked():
    if (ROOT / ".git").exists():
        try:
            done = subprocess.run(["git", "-C", str(ROOT), "ls-files", "-z"],
                                  capture_output=True, check=True, timeout=20)  # fmt: skip
            return [ROOT / name for name in done.stdout.decode().split("\0") if name]
        except (OSError, subprocess.SubprocessError):
            pass
    skipped = {"build", "dist", "node_modules", "__pycache__"}
    return [
        p
        for p in ROOT.rglob("*")
        if p.is_file()
        and not any(part in skipped or part.startswith(".v") for part in p.relative_to(ROOT).parts)
        and not any(part.startswith(".") and part.endswith("cache") for part in p.parts)
    ]


#: folders of somebody's machine, and package indexes other than the public one (letters in brackets
#: so that this file does not find itself)
TRACES = re.compile(
    r"(?<![\w.])/(?:[h]ome|[U]sers|[r]oot|[w]ork|[t]mp)/\w|C:[\\]+[U]sers|"
    r"--(?:extra-)?[i]ndex-url|--[f]ind-links|[l]ocalhost|127\.0\.[0]\.1|[f]ile://"
)


@pytest.mark.slow
def test_no_file_holds_a_path_or_a_host_of_somebody_s_machine():
    found = []
    for path in tracked():
        if not path.is_file() or path.suffix in (".png", ".pdf", ".ico"):
            continue
        text = path.read_bytes().decode("utf-8", errors="replace")
        found += [f"{path.relative_to(ROOT)}: {match.group()}" for match in TRACES.finditer(text)]
    assert not found


def test_the_traces_are_recognised():
    for trace in ("/ho" + "me/ann/x", "/Us" + "ers/ann", "--ind" + "ex-url https://a"):
        assert TRACES.search(trace)
    assert not TRACES.search("https://example.org/home/page")


def test_nothing_generated_is_committed():
    for path in tracked():
        name = path.relative_to(ROOT).as_posix()
        assert not name.startswith("reports/build/") and not name.endswith((".pyc", ".nbi", ".nbc"))
        assert not name.endswith(".json") or name.startswith("reference/tables/"), name


def test_shipped_text_ends_with_a_line_break_and_has_no_tabs_in_python():
    for path in tracked():
        if path.suffix in (".py", ".md", ".toml") and path.is_file():
            text = path.read_text(encoding="utf-8")
            assert text == "" or text.endswith("\n"), path
            assert path.suffix != ".py" or "\t" not in text, path
