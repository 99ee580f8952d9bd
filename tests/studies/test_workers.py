"""Whatever ends a run ends its workers: an interrupt, an error, the death of the first process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

from discmech.studies.command import entry, main
from discmech.studies.core.threads import SETTINGS
from discmech.studies.core.workers import worker_pool

SCRIPT = """
import os, signal, sys, time
from pathlib import Path
from discmech.studies.core.workers import worker_pool

def endless(file):
    Path(file).write_text(str(os.getpid()))
    time.sleep(10_000)

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # where it is begun in the background
    with worker_pool(2) as pool:
        for future in [pool.submit(endless, file) for file in sys.argv[1:]]:
            future.result()
"""
PATIENCE = 120  # seconds: a machine may be slow, but what does not end is found


def until(true):
    """Wait for something that has to come."""
    ends = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < ends
        time.sleep(0.05)


def lives(number):
    """Whether the process runs; one that has ended and was not asked after does not."""
    try:
        os.kill(number, 0)
        with open(f"/proc/{number}/stat", encoding="utf-8") as stat:
            return stat.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_these_tests_have_one_thread_of_linear_algebra_each():
    assert {*SETTINGS} & {*os.environ}


@pytest.mark.parametrize(("asked", "found"), [({}, "1"), ({"OMP_NUM_THREADS": "3"}, None)])
def test_processes_have_one_thread_of_linear_algebra_each(monkeypatch, asked, found):
    """Threads of processes that run side by side would wait for each other."""
    for name in SETTINGS:
        monkeypatch.delenv(name, raising=False)
    for name, value in asked.items():
        monkeypatch.setenv(name, value)
    with worker_pool(1) as pool:
        assert pool.submit(os.getenv, "OPENBLAS_NUM_THREADS").result() == found
    seen = []
    with monkeypatch.context() as patch:
        patch.setattr(entry, "main", lambda _: seen.append(os.getenv("OPENBLAS_NUM_THREADS")) or 0)
        assert main([]) == 0
    assert seen == [found] and not {*SETTINGS} - {*asked} & {*os.environ}


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks /proc what has ended")
@pytest.mark.parametrize(
    "ending",
    [
        *(pytest.param(s, marks=pytest.mark.slow) for s in (signal.SIGINT, signal.SIGTERM)),
        signal.SIGKILL,
    ],
)
def test_workers_end_with_the_first_process(ending, tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT, encoding="utf-8")
    files = [tmp_path / name for name in ("one", "two")]
    first = subprocess.Popen(
        [sys.executable, str(script), *map(str, files)], stderr=subprocess.DEVNULL
    )
    try:
        until(lambda: all(file.exists() and file.read_text() for file in files))
        workers = [int(file.read_text()) for file in files]
        assert all(map(lives, workers))
        first.send_signal(ending)
        assert first.wait(PATIENCE) != 0
        until(lambda: not any(map(lives, workers)))
    finally:
        first.kill()
        first.wait()
