"""Cases on the workers of a Dask scheduler: the numbers of one machine, whatever a worker does."""

import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from discmech.integrators import BadInput
from discmech.studies.command.entry import main
from discmech.studies.core.cluster import Cluster, _here, _refuse_others

ROOT = Path(__file__).resolve().parents[2]
ASKED = ["order", "harmonic", "pendulum", "kepler", "rigid-body", "--rule", "midpoint", "--rule",
         "trapezoidal", "--rule", "rectangle", "--digits", "16"]  # fmt: skip


@contextmanager
def process(*words, **more):
    """One process of a cluster, with whatever it starts; its lines of standard error."""
    made = subprocess.Popen([sys.executable, "-m", *words], stderr=subprocess.PIPE, text=True,
                            start_new_session=True, **more)  # fmt: skip
    try:
        yield made
    finally:
        os.killpg(made.pid, signal.SIGKILL)
        made.wait()
        made.stderr.close()


@pytest.fixture(scope="module")
def scheduler():
    words = ("distributed.cli.dask_scheduler", "--port", "0",
             "--no-dashboard")  # fmt: skip
    with process(*words) as made:
        line = next(line for line in made.stderr if "Scheduler at:" in line)
        yield line.split()[-1]


@contextmanager
def workers(scheduler, count, folder, **environment):
    """That many workers in one process each, without a nanny that starts them again."""
    words = ("distributed.cli.dask_worker", scheduler, "--nthreads", "1", "--no-nanny",
             "--no-dashboard")  # fmt: skip
    if count == 0:
        yield []
        return
    with process(*words, cwd=folder, env=os.environ | environment) as made:
        for line in made.stderr:
            if "Registered to" in line:
                break
        with workers(scheduler, count - 1, folder, **environment) as more:
            yield [made, *more]


def numbers(text):
    """The results without times, dates and what a store says."""
    found = json.loads(text)
    return [{key: case[key] for key in ("scene", "rule", "verdict", "measured", "rows")}
            for case in found["cases"]]  # fmt: skip


@pytest.mark.slow
def test_a_cluster_gives_the_numbers_of_one_machine_though_a_worker_is_killed(scheduler, tmp_path):
    def found(*more):
        cache = {"DISCMECH_CACHE": str(tmp_path / f"cache{len(more)}")}
        return subprocess.Popen(
            [sys.executable, "-m", "discmech.studies.command", *ASKED, *more, "--json", "-"],
            env=os.environ | cache, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip

    with workers(scheduler, 2, tmp_path, DISCMECH_CACHE=str(tmp_path / "theirs")) as (one, _):
        ours = found("--scheduler", scheduler)
        deadline = time.monotonic() + 300
        while not list((tmp_path / "theirs").glob("*")) and time.monotonic() < deadline:
            time.sleep(0.1)  # until a worker is at work
        one.kill()
        text, _ = ours.communicate(timeout=600)
        assert ours.returncode == 0
    with closing(
        sqlite3.connect(tmp_path / "cache2" / "discmech-cache" / "results" / "store.sqlite")
    ) as file:
        kept = file.execute("SELECT count(*) FROM entry WHERE kind = 'measurement'").fetchone()
    assert kept == (12,)  # kept here, as they came
    local = found().communicate(timeout=600)[0]
    assert numbers(text) == numbers(local) and len(numbers(text)) == 12


@pytest.mark.slow
def test_a_worker_with_another_text_is_refused_by_name(scheduler, tmp_path, capsys):
    for name in ("integrators", "reference", "studies", "tests/bench"):
        shutil.copytree(ROOT / name, tmp_path / name,
                        ignore=shutil.ignore_patterns("__pycache__"))  # fmt: skip
    shutil.copy(ROOT / "discmech.py", tmp_path)
    with (tmp_path / "studies" / "core" / "fitting.py").open("a") as file:
        file.write("# one line more\n")
    with workers(scheduler, 1, tmp_path, PYTHONPATH=str(tmp_path)):
        assert main([*ASKED, "--scheduler", scheduler]) == 2
    assert "has another text of discmech" in capsys.readouterr().err


@pytest.mark.slow
def test_without_a_scheduler_or_workers_it_is_said(scheduler, capsys):
    assert main([*ASKED, "--scheduler", "tcp://[::1]:1"]) == 2
    assert "no Dask scheduler answers at tcp://[::1]:1" in capsys.readouterr().err
    assert main([*ASKED, "--scheduler", scheduler]) == 2
    assert "has no workers" in capsys.readouterr().err


def test_without_dask_it_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(BadInput, match=r"discmech\[cluster\]"), Cluster("tcp://x:1").pool():
        pass


def test_one_says_who_measures(capsys):
    assert main([*ASKED, "--scheduler", "tcp://x:1", "--jobs", "2"]) == 2
    assert "give one" in capsys.readouterr().err


def test_workers_with_other_versions_are_named():
    here = _here()
    _refuse_others("w", here, dict(here))
    with pytest.raises(BadInput, match=r"the worker w has numpy 1\.0"):
        _refuse_others("w", here, here | {"numpy": "1.0"})
    with pytest.raises(BadInput, match="the worker w cannot load discmech"):
        _refuse_others("w", here, ImportError("no module"))
