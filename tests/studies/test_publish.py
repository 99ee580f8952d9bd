"""A folder of results is the old one or the new one, whenever a run is killed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from discmech.studies.report.publish import published

OLD, NEW = ("old", "a"), ("new", "b")


def write(folder, text, extra):
    with published(Path(folder), last="index.html") as new:
        for name in ("figures", "tables"):
            (new / name).mkdir()
            (new / name / f"{extra}.txt").write_text(text)
        (new / "index.html").write_text(text)


def content(folder):
    return {str(p.relative_to(folder)): p.read_text() for p in sorted(folder.rglob("*"))
            if p.is_file()}  # fmt: skip


def expected(text, extra):
    return {"index.html": text, f"figures/{extra}.txt": text, f"tables/{extra}.txt": text}


@pytest.fixture
def place(tmp_path):
    (tmp_path / "place").mkdir()
    return tmp_path / "place"


def test_what_fails_leaves_the_old_one(place):
    write(place / "page", *OLD)
    with pytest.raises(ZeroDivisionError), published(place / "page", last="index.html") as new:
        (new / "index.html").write_text("half")
        raise ZeroDivisionError
    assert content(place / "page") == expected(*OLD) and len(list(place.iterdir())) == 1


def test_things_of_others_stay_and_the_folder_that_one_is_in_is_not_moved(place, monkeypatch):
    monkeypatch.chdir(place)
    (place / "mine.txt").write_text("mine")
    for words in (OLD, NEW):
        write(".", *words)
        assert content(place) == expected(*words) | {"mine.txt": "mine"}
    inner = place / "inner"
    inner.mkdir()
    (inner / "mine.txt").write_text("mine")
    write("inner", *OLD)
    assert content(inner) == expected(*OLD) | {"mine.txt": "mine"}


@pytest.mark.skipif(sys.platform != "linux", reason="forks, and exchanges folders in one step")
@pytest.mark.slow
@pytest.mark.parametrize(
    "program", ["publish", "beside", "lattice", "motion", "study", "baseline", "report"]
)
def test_a_kill_at_any_point_loses_nothing(program):
    every = 1 if program in ("publish", "beside", "lattice", "motion") else 5
    words = [sys.executable, "-m", "tests.kill_points", program, "--every", str(every)]
    done = subprocess.run(words, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
