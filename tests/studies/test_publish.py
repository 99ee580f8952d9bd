"""A folder of results is the old one or the new one, whenever a run is killed."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from discmech import BadInput
from discmech.studies.core.ours import MANIFEST
from discmech.studies.report.publish import published
from tests.foreign_files import check_untouched, files_in, foreign_files

OLD, NEW = ("old", "a"), ("new", "b")


def write(folder, text, extra):
    with published(Path(folder), last="index.html") as new:
        for name in ("figures", "tables"):
            (new / name).mkdir()
            (new / name / f"{extra}.txt").write_text(text)
        (new / "index.html").write_text(text)


def content(folder):
    return {str(p.relative_to(folder)): p.read_text() for p in sorted(folder.rglob("*"))
            if p.is_file() and p.name != MANIFEST}  # fmt: skip


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


@pytest.mark.parametrize("days", [0, 1000])
def test_only_files_of_an_earlier_call_are_replaced(place, days):
    before = foreign_files(place, days)
    for words in (OLD, NEW):
        with pytest.raises(BadInput, match=r"index.html is there, and is not as discmech wrote it"):
            write(place, *words)
    assert files_in(place) == before
    (place / "index.html").unlink()
    del before["index.html"]
    for words in (OLD, NEW, OLD):
        write(place, *words)
        check_untouched(place, before)
        ours = {k: v for k, v in files_in(place).items() if k not in before and k != MANIFEST}
        assert {k: v.content.decode() for k, v in ours.items()} == expected(*words)


@pytest.mark.parametrize("name", ["figures/a.txt", "index.html"])
def test_a_file_that_somebody_changed_is_somebody_s(place, name):
    write(place / "page", *OLD)
    (place / "page" / name).write_text("by hand")
    with pytest.raises(BadInput, match="is not as discmech wrote it"):
        write(place / "page", "new", "a")
    assert content(place / "page") == expected(*OLD) | {name: "by hand"}


def test_a_manifest_names_no_file_elsewhere(place):
    write(place / "page", *OLD)
    (place / "mine.txt").write_text("old")
    listed = place / "page" / MANIFEST
    told = json.loads(listed.read_text())
    listed.write_text(json.dumps(told | {"../mine.txt": told["index.html"]}))
    (place / "page" / "other.txt").touch()  # so that files are moved one by one
    write(place / "page", *NEW)
    assert (place / "mine.txt").exists() and not (place / "page/figures/a.txt").exists()


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
