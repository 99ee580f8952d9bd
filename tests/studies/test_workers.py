"""Whatever ends a run ends its workers: an interrupt, an error, the death of the first process."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from queue import SimpleQueue
from threading import Lock

import pytest

from discmech.integrators import rules, scenes
from discmech.integrators.errors import CouldNotRun
from discmech.integrators.rules import midpoint, trapezoidal
from discmech.studies import get
from discmech.studies.command import entry, main
from discmech.studies.core import side_by_side, workers
from discmech.studies.core.case import Choice, silent
from discmech.studies.core.environment import SETTINGS
from discmech.studies.core.plan import Plan
from discmech.studies.core.userfile import load
from discmech.studies.core.workers import SAFE, worker_pool
from tests.studies.as_json import run_studies

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


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="asks /proc what has ended")
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
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


class Breaking(Executor):
    """As a pool of Python 3.12 is: its lock is held while futures hear that a worker was killed."""

    def __init__(self):
        self.lock, self.hung = Lock(), False

    def submit(self, *_):
        if self.lock.locked():
            self.hung = True
            raise RuntimeError
        return Killed(self.lock)


class Killed(Future):
    """Of a worker that is killed as soon as it has a task."""

    def __init__(self, lock):
        super().__init__()
        self.lock = lock

    def add_done_callback(self, call):
        super().add_done_callback(call)
        with self.lock:
            self.set_exception(BrokenProcessPool())


class Impatient(SimpleQueue):
    """Fails where nothing comes any more."""

    def get(self):
        return super().get(timeout=PATIENCE)


class Refusing(Executor):
    """Of a system that has no thread left."""

    def submit(self, *_):
        raise RuntimeError("can't start new thread")


@pytest.mark.parametrize(("pool", "said"), [
    (Breaking(), (CouldNotRun, "was killed")), (Refusing(), (RuntimeError, "new thread")),
])  # fmt: skip
def test_a_pool_that_ends_ends_the_run(monkeypatch, pool, said):
    @contextmanager
    def made(*_):
        yield pool

    monkeypatch.setattr(side_by_side, "worker_pool", made)
    monkeypatch.setattr(side_by_side, "SimpleQueue", Impatient)
    monkeypatch.setattr(side_by_side, "measured", lambda *_: {})
    rules = (midpoint, trapezoidal)
    some = tuple(map(scenes.get, ("harmonic", "pendulum", "kepler")))
    plan = Plan([get("order"), get("energy")], Choice(scenes=some, rules=rules))
    tasks = plan.tasks(set(), set())
    assert len(tasks) == 6 and sum(len(t.places) for t in tasks) >= side_by_side.WORTH_WORKERS
    with pytest.raises(said[0], match=said[1]):
        list(side_by_side.finished(plan, tasks, 2, None, silent, None))
    assert not getattr(pool, "hung", False)


def test_a_race_is_one_task_and_other_times_have_the_machine_alone(monkeypatch):
    some = tuple(map(scenes.get, ("harmonic", "pendulum")))
    chosen = [get("energy"), get("work-precision"), get("savings")]
    monkeypatch.delattr(chosen[2].measuring, "together")  # as if its times were not compared
    plan = Plan(chosen, Choice(scenes=some, rules=(midpoint, trapezoidal)))
    tasks = plan.tasks(set(), set(range(len(plan.pairs))))
    studied = [{chosen[i].name for i, _ in task.places} for task in tasks]
    assert sorted(map(tuple, studied)) == [("energy",)] * 4 + [("work-precision",)] * 2
    races = [task for task, names in zip(tasks, studied, strict=True) if "energy" not in names]
    for task in races:
        (race,) = {id(plan.case(place).race) for place in task.places}
        (methods,) = {tuple(plan.case(place).race.methods) for place in task.places}
        assert len(methods) == len(task.places) and race
    on_others = plan.tasks(set(), set(range(len(plan.pairs))), elsewhere=True)
    assert {chosen[i].name for t in on_others for i, _ in t.places} == {"energy"}


@pytest.mark.slow
def test_a_process_that_is_ended_at_once_says_nothing_of_what_it_leaves(tmp_path):
    script = tmp_path / "ended.py"
    script.write_text(
        "import os\nfrom discmech.studies.core.workers import worker_pool\n"
        "if __name__ == '__main__':\n"
        "    with worker_pool(1) as pool:\n"
        "        pool.submit(os.getpid).result()\n"
        "        os._exit(3)\n"
    )
    ended = subprocess.run([sys.executable, script], capture_output=True, text=True)
    assert (ended.returncode, ended.stderr) == (3, "")
    assert "PYTHONWARNINGS" not in os.environ


@pytest.mark.slow
@pytest.mark.parametrize("safe", [None, "", "1"])
def test_processes_run_no_file_of_the_current_folder_in_place_of_a_module(
    safe, tmp_path, monkeypatch
):
    """And the programs that they start find the settings that the user made."""
    for name in ("multiprocessing", "socket", "random", "pickle", "numpy"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('a file of the user')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(SAFE, safe) if safe is not None else monkeypatch.delenv(SAFE, raising=False)
    with worker_pool(1) as pool:
        assert pool.submit(os.getenv, SAFE).result() == safe
    assert os.environ.get(SAFE) == safe


@pytest.mark.slow
def test_what_two_processes_measure_is_told_once(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "gone.py").write_text("from discmech import Scene, pair\n"
        "s = Scene('gone', pair(1), lambda x, v, p: v[0] ** 2, x0=[0], v0=[0])")  # fmt: skip
    load("gone.py")
    (tmp_path / "gone.py").unlink()  # nobody asks for it
    told = []
    some = tuple(map(scenes.get, ("harmonic", "kepler")))
    by = tuple(map(rules.get, ("midpoint", "rectangle")))
    studies, choice = [get("symplecticity"), get("order")], Choice(some, by, (16,))
    results, _ = run_studies(studies, choice, told=told.append, jobs=2)
    asked = [(r["study"], c["scene"], c["rule"]) for r in results for c in r["cases"]]
    assert sorted((c.study, c.scene, c.rule) for c in told) == sorted(asked)


def test_what_a_process_tells_is_heard():
    heard = []
    with worker_pool(1, heard.append) as pool:
        assert pool.submit(workers.tell, "a result").result() is None
    assert heard == ["a result"]
    with worker_pool(1) as pool:  # to whom nobody listens
        assert pool.submit(workers.tell, "a result").result() is None


def test_a_listener_that_fails_leaves_it_to_the_task():
    news, heard = SimpleQueue(), []

    def hear(told):
        heard.append(told)
        raise BrokenPipeError

    for told in (1, 2, None):
        news.put(told)
    workers._listen(news, hear)
    assert heard == [1]
