"""What a command writes: where it was typed, and over nothing that is not ours."""

import argparse
import json
import os
import re
import shlex
import subprocess
import sys
from threading import Thread

import pytest

from discmech.studies.command.entry import _parser
from discmech.studies.command.output import FILES as OPTIONS
from discmech.studies.core.study import every_study
from tests.foreign_files import check_untouched, files_in, foreign_files
from tests.imports import ROOT
from tests.studies.test_userfile import RULE

FEW = ("--scene", "harmonic", "--study", "order", "--digits", "16", "--steps", "16")
STUDY = ("harmonic", "--rule", "midpoint", "--digits", "16", "--steps", "16")
#: one command of each kind that writes a file, and the option
FILES = [
    (("list",), "json"), (("list", "--words"), "json"),
    (("run", "harmonic", "--steps", "2"), "json"),
    (("modified", "harmonic", "midpoint", "--order", "2"), "json"),
    (("order", *STUDY), "json"), (("reference", "harmonic", "--digits", "20"), "json"),
    (("verify", "midpoint", *FEW), "json"), (("verify", "midpoint", *FEW), "html"),
    (("verify", "midpoint", *FEW), "badge"), (("compare", "midpoint", "trapezoidal", *FEW), "html"),
    (("compare", "midpoint", "trapezoidal", *FEW), "json"),
    (("prove", "midpoint", "--order", "1", "--groupoid", "time"), "json"),
]  # fmt: skip
UNSEEN = [  # refused before they begin
    *FILES, (("gallery",), "page"), (("gallery",), "json"), (("control", "reorientation"), "json"),
    (("export", "pendulum", "midpoint", "--language", "c"), "out"),
]  # fmt: skip


def test_no_command_that_writes_a_file_is_left_out():
    (commands,) = (a for a in _parser()._actions if isinstance(a, argparse._SubParsersAction))
    writing = {("order" if name in every_study() else name, action.dest) for name, parser
               in commands.choices.items() for action in parser._actions
               if action.dest in OPTIONS}  # fmt: skip
    assert writing == {(words[0], option) for words, option in UNSEEN}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path / "here"


@pytest.mark.slow
@pytest.mark.parametrize(("words", "option"), UNSEEN, ids=str)
def test_no_output_replaces_a_file_of_somebody_else(ask, folder, words, option):
    before = foreign_files(folder, 1000)
    for name in before:
        code, out, said = ask(*words, f"--{option}", name)
        assert (code, out) == (2, "") and said.count("\n") == 1, (name, said)
        assert f"{name} is there, and is no such result of discmech, or was changed since: " in said
    assert files_in(folder) == before


@pytest.mark.parametrize("words", [("order", *STUDY), ("report", *STUDY),
                                   ("references",)])  # fmt: skip
def test_nor_does_a_page(ask, folder, words):
    before = foreign_files(folder, 1000)
    code, _, said = ask(*words, "--folder", ".")
    assert code == 2 and "index.html is there, and is not as discmech wrote it" in said
    assert files_in(folder) == before


@pytest.mark.slow
def test_a_page_leaves_the_pictures_of_others(ask, folder):
    before = foreign_files(folder, 1000)
    del before["index.html"]
    (folder / "index.html").unlink()
    for _ in range(2):
        assert ask("order", *STUDY, "--folder", ".")[0] == 0
        check_untouched(folder, before)
        assert (folder / "index.html").exists() and (folder / "tables/order.csv").exists()
    (folder / "tables/order.csv").write_text("by hand")
    code, _, said = ask("order", *STUDY, "--folder", ".")
    assert code == 2 and "tables/order.csv is there" in said
    assert (folder / "tables/order.csv").read_text() == "by hand"


@pytest.mark.dear("html", "order', '2')")
@pytest.mark.parametrize(("words", "option"), FILES, ids=str)
def test_ours_is_replaced_and_a_missing_folder_made(ask, folder, words, option):
    file = folder / "out" / "deep" / "result"
    assert ask(*words, f"--{option}", "out/deep/result")[0] == 0
    file.write_text(file.read_text() + "\n")
    ours = file.read_text()
    assert ask(*words, f"--{option}", "out/deep/result")[0] == 0
    assert file.read_text() != ours
    file.write_text("")  # nobody's
    assert ask(*words, f"--{option}", str(file))[0] == 0 and file.read_text()


@pytest.mark.parametrize("text", ["{}", "[]", "[1]", "null", '{"study": 1}', "{", "[" * 10**5,
                                  "<!doctype html><p>discmech", "\udcff{}"])  # fmt: skip
def test_what_only_looks_like_ours_is_not(ask, folder, text):
    (folder / "file").write_text(text, errors="surrogateescape")
    assert ask("list", "--json", "file")[0] == 2


def test_a_pipe_is_written_to_and_stays(ask, folder):
    ours, theirs = os.pipe()
    os.mkfifo("named")
    words, seen = ("run", "harmonic", "--steps", "2", "--json"), list[str]()
    reader = Thread(target=lambda: seen.append((folder / "named").read_text()), daemon=True)
    reader.start()
    assert ask(*words, "named")[0] == 0 == ask(*words, f"/dev/fd/{theirs}")[0]
    reader.join(10)
    assert all(json.loads(text)["mu"] for text in (*seen, os.read(ours, 10**4)))
    os.close(ours)
    os.close(theirs)
    assert (folder / "named").is_fifo()


@pytest.mark.slow
def test_standard_output_has_other_names(folder):
    words = (sys.executable, "-m", "discmech.studies.command", "list", "--json")
    with (folder / "out").open("w") as out:
        for name in ("/dev/stdout", "out", "-"):
            assert subprocess.run([*words, name], stdout=out, check=True)
    said = (folder / "out").read_text()
    once = said[: len(said) // 3]
    assert said == 3 * once and "order" in json.loads(once)["studies"]
    piped = subprocess.run([*words, "/dev/stdout"], capture_output=True, text=True)
    assert piped.stdout == once


def test_the_rule_that_is_judged_stays(ask, folder):
    (folder / "r.py").write_text(RULE)
    (folder / "link.json").symlink_to("r.py")
    for name in ("r.py", "link.json"):
        assert ask("order", "harmonic", "--rule", "r.py", "--json", name)[0] == 2
    assert (folder / "r.py").read_text() == RULE
    code, _, said = ask("verify", "r.py", "--json", "a", "--html", "./a")
    assert code == 2 and "./a is to be written twice" in said


@pytest.mark.slow
def test_names_are_those_of_the_folder_where_they_were_typed(ask, folder, monkeypatch):
    (folder / "r.py").write_text(f"import os\nos.chdir('..')\n{RULE}")
    (folder / "s.py").write_text(f"import os\nos.chdir('/')\n{RULE.replace('two_', 'other_')}")
    code, _, said = ask("compare", "r.py", "s.py", *FEW, "--json", "o.json", "--html", "o.html",
                        "--jobs", "2")  # fmt: skip
    assert code == 0, said
    assert {"o.json", "o.html"} < {p.name for p in folder.iterdir()}
    assert {p.name for p in folder.parent.iterdir()} <= {"here", "cache"}
    monkeypatch.chdir(folder)
    words = ("order", "harmonic", "--rule", "r.py:two-thirds", "--digits", "16", "--steps", "16")
    (folder / "r.py").write_text(f"import os\nos.chdir('/')\n{RULE}\n")
    assert ask(*words, "--json", "a/o.json", "--folder", "b")[0] == 0
    assert json.loads((folder / "a/o.json").read_text())["study"] == "order"
    assert (folder / "b" / "index.html").exists()


@pytest.mark.slow
def test_the_lines_of_the_page_about_ci_run_in_an_empty_folder(ask, folder):
    text = (ROOT / "docs/how-to/ci.md").read_text("utf-8")
    (line,) = re.findall(r"- run: discmech (.*)", text)
    own = (ROOT / "studies/user/starters/rule.py").read_text("utf-8")
    (folder / "my_rule.py").write_text(own)
    assert ask(*shlex.split(line), *FEW[2:])[0] == 0
    written = {p.name for p in (folder / "out").iterdir()}
    assert written == {"verdicts.json", "verdicts.html", "badge.svg"}
