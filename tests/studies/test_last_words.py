"""A process that could not run ends with 4 and one sentence; 1 says that a verdict failed."""

import errno
import json
import os
import signal
import subprocess
import sys
import time

import pytest

from discmech.integrators.errors import CouldNotRun
from discmech.studies import get

SHORT = ("energy", "harmonic", "--rule", "midpoint", "--digits", "16", "--steps", "50")
posix = pytest.mark.skipif(sys.platform == "win32", reason="closes streams, sets limits")


def begun(words, tmp_path, shell="", **more):
    """The command in a process of its own, behind some words of a shell's."""
    own = {"DISCMECH_CACHE": str(tmp_path / "cache"), "TMPDIR": str(tmp_path)} | more
    env = {k: v for k, v in {**os.environ, **own}.items() if v is not None}
    program = " ".join([f'"{sys.executable}" -m discmech.studies.command', *words])
    line = f"{shell} {program}" if "{}" not in shell else shell.format(program)
    done = subprocess.run(["sh", "-c", line], cwd=tmp_path, env=env, capture_output=True)
    out, err = (b.decode("utf-8", "replace") for b in (done.stdout, done.stderr))
    assert "Traceback" not in err, err
    return done.returncode, out, err


@pytest.mark.parametrize("error", [
    OSError(errno.EIO, "Input/output error", "/a/file"), OSError(errno.ESTALE, "Stale file handle"),
    OSError(errno.EMFILE, "Too many open files"), OSError(errno.EFBIG, "File too large"),
    OSError(errno.ENOSPC, "No space left on device"), MemoryError(), RecursionError("too deep"),
    RuntimeError("can't start new thread"), ImportError("cannot map"), KeyError("x"),
    CouldNotRun("the disk is gone."),
], ids=repr)  # fmt: skip
def test_what_the_machine_refuses_is_a_sentence(error, ask, monkeypatch):
    def fail(*_):
        raise error

    monkeypatch.setattr(get("energy").measuring, "measure", fail)
    code, out, err = ask(*SHORT)
    assert (code, out) == (4, "") and err.count("\n") == 1 and err.startswith("discmech: ")
    assert ("make room" in err) == ("No space" in str(error))
    own = isinstance(error, (RecursionError, KeyError))
    assert ("please report it" in err) == own and ("goes on where it stopped" in err) == (
        not own and not isinstance(error, ImportError)
    )


def test_numbers_that_could_not_be_written_are_told_from_a_bad_name(ask, tmp_path):
    code, _, err = ask("run", "harmonic", "--steps", "3", "--json", "/dev/full")
    assert code == 4 and "/dev/full cannot be written (No space left on device); make room" in err
    (tmp_path / "loop").symlink_to("loop")
    for name in ("loop", "x" * 300):
        code, _, err = ask("run", "harmonic", "--steps", "3", "--json", str(tmp_path / name))
        assert code == 2 and "cannot be written" in err
    for words in (("run", "9" * 5000), ("new", "rule", "mine", "--folder", "x" * 300)):
        code, _, err = ask(*words)
        assert code == 2 and "is no name of a file" in err and len(err) < 300


def test_exit_codes_are_in_the_help(ask):
    assert "4 could not run" in " ".join(ask("--help")[1].split())


@posix
@pytest.mark.slow
class TestProcess:
    """Streams, limits and signals, each in a process of its own."""

    @pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
    def test_closed_streams(self, closed, tmp_path):
        code, out, _ = begun([*SHORT, "--json", "found.json", closed], tmp_path)
        assert code == 0 and json.loads((tmp_path / "found.json").read_text())["verdict"] == "pass"
        assert ">&-" not in out

    def test_a_full_standard_output(self, tmp_path):
        code, _, err = begun(["list", ">/dev/full"], tmp_path)
        assert code == 4 and "standard output takes nothing (No space left on device)" in err

    def test_a_reader_that_goes_does_not_change_the_verdict(self, tmp_path):
        words = ("order", "harmonic", "--control", '"first-order splitting"', "--steps", "16")
        plain = begun([*words[:2], "--rule", "rectangle", "--digits", "16"], tmp_path)[0]
        code, out, _ = begun([*words[:2], "--rule", "rectangle", "--digits", "16"], tmp_path,
                             "( {} ; echo code $? >&2 ) | true")  # fmt: skip
        assert plain == 0 and code == 0 and out == ""

    @pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
    def test_few_letters(self, encoding, tmp_path):
        more = {"PYTHONIOENCODING": encoding, "LC_ALL": "C", "PYTHONUTF8": "0"}
        code, out, _ = begun(["run", "pendulum", "--steps", "3", "--json", "-"], tmp_path, **more)
        assert code == 0 and json.loads(out)["scene"] == "pendulum"
        assert begun(SHORT, tmp_path, **more)[0] == 0

    def test_no_home(self, tmp_path):
        none = dict.fromkeys(("HOME", "DISCMECH_CACHE", "XDG_CACHE_HOME"))
        code, _, err = begun(SHORT, tmp_path, **{**none, "HOME": "/dev/null/at/all"})
        assert code == 0 and "Traceback" not in err
        assert not [p for p in tmp_path.iterdir() if p.name.startswith("discmech")]

    @pytest.mark.parametrize("limit", ["ulimit -f 1;", "ulimit -n 12;", "ulimit -v 400000;"])
    def test_limits(self, limit, tmp_path):
        code, _, err = begun([*SHORT, "--json", "found.json"], tmp_path, limit)
        assert code in (0, 4) and (code == 0 or "discmech: " in err), err

    @pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
    def test_signals_to_stop(self, number, tmp_path):
        own = {"DISCMECH_CACHE": str(tmp_path / "cache"), "TMPDIR": str(tmp_path)}
        process = subprocess.Popen(
            [sys.executable, "-m", "discmech.studies.command", "order", "--folder", "page"],
            cwd=tmp_path, env={**os.environ, **own}, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        ends = time.monotonic() + 60
        while time.monotonic() < ends and not list(
            (tmp_path / "cache").glob("*/results/store.sqlite")
        ):
            time.sleep(0.2)
        process.send_signal(number)
        _, said = process.communicate()
        assert process.returncode == 128 + number, said
        assert said == "discmech: interrupted; the same command goes on where it stopped.\n"
        left = [p.name for p in tmp_path.iterdir() if p.name not in ("cache", "page")]
        assert left == [], left


def test_a_reference_that_is_none_is_inconclusive(ask, monkeypatch):
    from discmech.reference import ReferenceFailure

    def fail(*_, **more):
        raise ReferenceFailure("no digits.")

    monkeypatch.setattr("discmech.studies.core.running.run_study", fail)
    assert ask(*SHORT)[0] == 3
