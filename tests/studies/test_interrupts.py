"""Ctrl-C in a process of its own: it ends with its workers, and what was finished is kept."""

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from discmech import Scene, midpoint, pair, scenes
from discmech.studies import get
from discmech.studies.command.interrupts import PATIENCE
from discmech.studies.core.case import Case
from discmech.studies.core.side_by_side import measured
from discmech.studies.core.store import Store
from tests.studies.as_json import run_case
from tests.studies.kills import measurements_in
from tests.studies.test_userfile import RULE
from tests.studies.test_workers import lives, until

#: as a terminal has it; where a test runs in the background interrupts may be ignored
BEGIN = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
from discmech.studies.command import main
sys.argv = ["discmech", *sys.argv[1:]]
"""
DEAF = """
import ctypes, time
from discmech.studies.command import entry
def forever(options):
    print("begun", flush=True)
    try:
        time.sleep(10_000)
    except KeyboardInterrupt:  # as a library may swallow it
        ctypes.CDLL(None).sleep(10_000)  # and machine code knows none
entry._list = forever
"""
RUN = "if __name__ == '__main__':\n    sys.exit(main())\n"


def begun(tmp_path, text, *words):
    script = tmp_path / "script.py"
    script.write_text(text, encoding="utf-8")
    caches = {"DISCMECH_CACHE": str(tmp_path / "cache")}
    return subprocess.Popen(
        [sys.executable, str(script), *words], cwd=tmp_path, env={**os.environ, **caches},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, encoding="utf-8",
        start_new_session=True,
    )  # fmt: skip


def descendants(number):
    """Children and their children, by /proc."""
    found = []
    for task in Path(f"/proc/{number}/task").glob("*/children"):
        for child in map(int, task.read_text().split()):
            found += [child, *descendants(child)]
    return found


linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks /proc what has ended")
COMMANDS = (
    ("verify", "mine.py", "--jobs", "2"),
    pytest.param(("compare", "mine.py", "midpoint", "--jobs", "2"), marks=pytest.mark.slow),
    pytest.param(("order", "--jobs", "2"), marks=pytest.mark.slow),
    pytest.param(("report", "--folder", "page", "--jobs", "2"), marks=pytest.mark.slow),
)


@pytest.mark.slow
@linux
@pytest.mark.parametrize("words", COMMANDS, ids=lambda words: words[0])
def test_an_interrupt_ends_the_command_and_its_workers(words, tmp_path):
    (tmp_path / "mine.py").write_text(RULE, encoding="utf-8")
    process = begun(tmp_path, BEGIN + RUN, *words)

    def kept():
        return measurements_in(tmp_path / "cache")

    try:
        until(lambda: process.poll() is not None or kept())
        workers = descendants(process.pid)
        os.killpg(process.pid, signal.SIGINT)  # a terminal tells all of them
        _, said = process.communicate()
        assert process.returncode == 130 and workers
        assert said == "discmech: interrupted; the same command goes on where it stopped.\n"
        until(lambda: not any(map(lives, workers)))
        assert kept() and not list(tmp_path.glob("page/index.html"))
    finally:
        process.kill()
        process.wait()


@pytest.mark.slow
@linux
@pytest.mark.parametrize("ending", ["one", "all", "killed"])
def test_machine_code_that_hears_nothing_is_ended(ending, tmp_path):
    assert PATIENCE < 2
    process = begun(tmp_path, BEGIN + DEAF + RUN, "list")
    try:
        assert process.stdout.readline() == "begun\n"
        (own,) = descendants(process.pid)
        if ending == "one":
            process.send_signal(signal.SIGINT)
        else:
            os.killpg(process.pid, signal.SIGINT) if ending == "all" else process.kill()
        said = process.communicate()[1]
        wanted = (-signal.SIGKILL, "") if ending == "killed" else (130, "discmech: interrupted.\n")
        assert (process.returncode, said) == wanted
        until(lambda: not lives(own))
    finally:
        process.kill()
        process.wait()


@pytest.mark.parametrize("stored", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_wait_for_a_cause_says_so(stored, tmp_path, monkeypatch):
    """Last, as the search comes after the measurement; with a store and without."""
    monkeypatch.setenv("DISCMECH_CACHE", str(tmp_path))
    told, claims = [], replace(midpoint, name="claims-3", order=3)
    asked = Case("order", scenes.get("harmonic"), claims, 16)
    store = Store() if stored else None
    result = measured(get("order"), asked, lambda *news: told.append(news), store)
    assert result.verdict == "fail"
    assert told[-1] == ("harmonic claims-3: looking for the cause", 1.0)


@pytest.mark.slow
def test_a_wait_for_a_reference_says_how_far_it_is(tmp_path, monkeypatch):
    monkeypatch.setenv("DISCMECH_CACHE", str(tmp_path))  # in which nobody has left it
    told = []
    scene = Scene("soft", pair(1), lambda x, v, p: v[0] ** 2 / 2 - x[0] ** 4 / 4 - x[0] ** 2 / 3,
                  x0=[1], v0=["1/7"], duration=4, step="1/20")  # fmt: skip
    asked = Case("order", scene, midpoint, 16)
    found = run_case(get("order"), asked, lambda *news: told.append(news))
    assert found["verdict"] == "pass"
    shares = [share for label, share in told if label == "soft midpoint: reference"]
    assert len(shares) > 10 and any(0.2 < share < 0.8 for share in shares)
