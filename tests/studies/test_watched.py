"""A command ends with 4 unless it came to its own end, whatever ends its process."""

import subprocess
import sys

import pytest

from discmech.studies.command.watched import watched

BOXES = """
import ctypes, os, signal
from discmech import black_box

@black_box(order=2)
def stops(q, p, h, system):  # as STOP of Fortran
    ctypes.CDLL(None).exit(0)

@black_box(order=2)
def leaves(q, p, h, system):
    os._exit(0)

@black_box(order=2)
def crashes(q, p, h, system):
    os.kill(os.getpid(), signal.SIGSEGV)
"""
posix = pytest.mark.skipif(sys.platform == "win32", reason="forks")
ENDS = [
    ("run harmonic --rule boxes.py:stops", "with exit code 0 before"),
    ("run harmonic --rule boxes.py:leaves", "with exit code 0 before"),
    ("run harmonic --rule boxes.py:crashes", "by SIGSEGV before"),
    ("order harmonic --rule boxes.py:leaves --json -", "with exit code 0 before"),
    pytest.param(
        "verify boxes.py:stops --jobs 1", "with exit code 0 before", marks=pytest.mark.slow
    ),
    pytest.param(
        "report harmonic --rule boxes.py:stops --jobs 1", "exit code", marks=pytest.mark.slow
    ),
]


@pytest.mark.slow
@posix
@pytest.mark.parametrize(("words", "how"), ENDS)
def test_what_ends_the_process_is_no_verdict(words, how, tmp_path):
    (tmp_path / "boxes.py").write_text(BOXES)
    line = [sys.executable, "-m", "discmech.studies.command", *words.split()]
    ended = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True)
    assert (ended.returncode, ended.stdout) == (4, ""), ended.stderr
    assert f"the command ended {how}" in ended.stderr and ended.stderr.count("\n") == 1


@posix
@pytest.mark.slow
def test_nor_is_it_in_a_process_that_measures(tmp_path):
    (tmp_path / "boxes.py").write_text(BOXES)
    line = [sys.executable, "-m", "discmech.studies.command", "verify", "boxes.py", "--jobs", "3"]
    ended = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True)
    assert ended.returncode == 4 and "✓" not in ended.stdout, ended.stderr


def test_python_s_own_exit_is_no_end_of_the_command(ask, monkeypatch):
    def leave(*_, **more):
        raise SystemExit(0)

    monkeypatch.setattr("discmech.studies.command.entry.write_json", leave)
    code, out, said = ask("list", "--json", "-")
    assert (code, out) == (4, "") and "asks to exit" in said


@posix
@pytest.mark.parametrize(("end", "code"), [
    ("return 3", 3), ("return 0", 0), ("raise SystemExit(2)", 2), ("os._exit(0)", 4),
    ("os._exit(143)", 143), ("os.kill(os.getpid(), 9)", 4),
    ("atexit.register(os._exit, 0); return 1", 1),  # what comes after its end changes nothing
])  # fmt: skip
def test_the_exit_code_is_what_the_command_says(end, code):
    assert watched.__module__ == "discmech.studies.command.watched"
    text = (f"import atexit, os, sys\nfrom {watched.__module__} import watched\n"
            f"def command():\n    {end}\nsys.exit(watched(command))")  # fmt: skip
    ended = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True)
    assert ended.returncode == code, ended.stderr
    assert (ended.stderr != "") == (code == 4)


@posix
def test_a_stop_after_the_command_has_ended_changes_nothing():
    text = (f"import os, sys\nfrom {watched.__module__} import watched\n"
            f"module = sys.modules['{watched.__module__}']\ncode_of = module._code\n"
            "module._code = lambda *told: os.kill(os.getpid(), 15) or code_of(*told)\n"
            "sys.exit(watched(lambda: 3))")  # fmt: skip
    ended = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True)
    assert (ended.returncode, ended.stderr) == (3, "")
