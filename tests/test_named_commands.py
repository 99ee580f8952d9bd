"""What workflows, Makefile and pages name is there: modules, files, targets, commands, pins."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from discmech.studies.command.entry import _parser
from tests.imports import ROOT
from tests.pages import PAGES

yaml = pytest.importorskip("yaml", reason="`make setup` installs it")

WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
MAKEFILE = (ROOT / "Makefile").read_text("utf-8")
TARGETS = set(re.findall(r"^([a-z-]+):", MAKEFILE, re.M))
PINS = [ROOT / name for name in ("requirements-lock.txt", "requirements-docs.txt")]
INSTALLED = set(re.findall(r"^([\w.-]+)==", PINS[0].read_text("utf-8"), re.M))
#: what a page writes for something of the reader's
OPEN = re.compile(r"…|\.\.\.|\[[^\]]* |<|\b[A-Z]{2,}\b")


def of_yaml(found: object) -> Iterator[str]:
    """Every command of a workflow, or of a hook."""
    if isinstance(found, list):
        for entry in found:
            yield from of_yaml(entry)
    elif isinstance(found, dict):
        for key, entry in found.items():
            if key in ("run", "entry"):
                yield from str(entry).splitlines()
            else:
                yield from of_yaml(entry)


def of_page(text: str) -> Iterator[str]:
    """Commands in a page: the code spans of its prose and the lines of its shell blocks."""
    fences = r"^```(\w*)\n(.*?)^```"
    for language, block in re.findall(fences, text, re.M | re.S):
        if language == "sh":
            yield from block.replace("\\\n", " ").splitlines()
    prose = re.sub(fences, "", text, flags=re.M | re.S)
    yield from (span.replace("\n", " ") for span in re.findall(r"(?<!`)`([^`]+)`(?!`)", prose))


def commands_of(path: Path) -> list[str]:
    text = path.read_text("utf-8")
    if path.suffix in (".yml", ".yaml"):
        return list(of_yaml(yaml.safe_load(text)))
    if path.suffix == ".md":
        return list(of_page(text))
    return [line.strip() for line in text.splitlines()]


def what_is_wrong(command: str) -> str:
    """Say what the command names that is not there; "" if all is."""
    try:
        words = shlex.split(re.sub(r"\$\([^)]*\)", "1", command), comments=True)
    except ValueError:  # prose
        return ""
    program = Path(words[0]).name if words else ""
    if program == "make":
        asked = [w for w in words[1:] if not w.startswith("-") and "=" not in w]
        return " ".join(set(asked) - TARGETS)
    if program in ("python", "python3") and words[1:2] == ["-m"]:
        return "" if has_module(words[2]) else words[2]
    if program in ("python", "pytest"):  # a file without a folder is one of the reader
        files = [w for w in words[1:] if re.fullmatch(r"[\w.]+/[\w./-]+\.py", w)]
        return " ".join(w for w in files if not (ROOT / w).is_file())
    if program == "discmech" and len(words) > 1 and not re.search(r"\.py\b", words[1]):
        try:
            _parser().parse_args(words[1:])
        except SystemExit as end:  # a command may be named without what it is of
            return "" if not end.code or (len(words) == 2 and words[1] in _names()) else command
    installed = program in {*INSTALLED, "discmech"} or not command.startswith(".venv/bin/")
    return "" if installed else program


def _names() -> set[str]:
    actions = _parser()._subparsers._group_actions  # of argparse
    return {name for action in actions for name in action.choices}


def has_module(name: str) -> bool:
    """Whether it is one of ours that is there, or one of a library."""
    try:
        return not name.startswith(("discmech.", "tests.")) or find_spec(name) is not None
    except ModuleNotFoundError:
        return False


NAMING = [*WORKFLOWS, ROOT / ".pre-commit-config.yaml", ROOT / ".ci" / "run", *PAGES,
          *(ROOT / f"{name}.md" for name in ("CONTRIBUTING", "NOTATION"))]  # fmt: skip


@pytest.mark.dear("take", "verdicts.md", "commands.md")
@pytest.mark.parametrize("path", NAMING, ids=lambda path: path.name)
def test_what_is_named_is_there(path, capsys):
    said = [c for c in commands_of(path) if path.suffix != ".md" or not OPEN.search(c)]
    assert not [(c, wrong) for c in said if (wrong := what_is_wrong(c))]


def test_what_the_makefile_runs_is_there():
    modules = set(re.findall(r"/python -m ([\w.]+)", MAKEFILE))
    files = set(re.findall(r"(?:tests|\.ci|docs|studies)/[\w/.]+\.(?:py|c)\b", MAKEFILE))
    assert {"tests.paper", "tests.mutants"} <= modules and ".ci/lowest.py" in files
    assert not [name for name in modules if not has_module(name)]
    assert not [name for name in files if not (ROOT / name).is_file()]


@pytest.mark.parametrize("command", [
    "make lnit", "python -m discmech.studies.command.crossovers crossovers.md",
    "python -m tests.nowhere", "python examples/none.py", "discmech odrer",
    "discmech order --rle R", "discmech power --thorough --jobs 4 --seeds 3",
    ".venv/bin/discmech list --jsn -", ".venv/bin/flake8 .",
])  # fmt: skip
def test_what_is_not_there_is_noticed(command, capsys):
    assert what_is_wrong(command)


@pytest.mark.parametrize("path", PINS, ids=lambda path: path.name)
def test_each_pin_has_hashes_and_no_address(path):
    text = re.sub(r"^#.*\n", "", path.read_text("utf-8"), flags=re.M)
    pins = re.split(r"\n(?=\S)", text.strip())
    one = r"[\w.-]+==[\w.+!-]+( ; [^\\\n]+)?( \\\n    --hash=sha256:[0-9a-f]{64})+"
    assert len(pins) > 20 and not [pin for pin in pins if not re.fullmatch(one, pin)]
    assert f"--require-hashes -r $({'DOCS' if 'docs' in path.name else 'LOCK'})" in MAKEFILE


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_each_action_is_a_commit_with_its_version(path):
    used = re.findall(r"^.*\buses:.*$", path.read_text("utf-8"), re.M)
    pinned = re.compile(r"\s*-? ?uses: [\w-]+/[\w/-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+")
    assert used and not [line for line in used if not pinned.fullmatch(line)]
