"""The folders that are ours, and where they are."""

import os
import subprocess
import sys

import pytest

from discmech.integrators import places
from tests.foreign_files import check_untouched, files_in, foreign_files

NAMED = "DISCMECH_CACHE", "XDG_CACHE_HOME", "XDG_DATA_HOME"


@pytest.mark.parametrize(("named", "cache", "baselines"), [
    ({}, ".cache/discmech-cache", ".local/share/discmech-baselines"),
    ({"XDG_CACHE_HOME": "c", "XDG_DATA_HOME": "d"}, "c/discmech-cache", "d/discmech-baselines"),
    ({"XDG_CACHE_HOME": "c", "DISCMECH_CACHE": "own"},
     "own/discmech-cache", "own/discmech-baselines"),
])  # fmt: skip
def test_they_lie_where_the_environment_says(tmp_path, monkeypatch, named, cache, baselines):
    monkeypatch.setenv("HOME", str(tmp_path))
    for name in NAMED:
        monkeypatch.delenv(name, raising=False)
    for name, folder in named.items():
        monkeypatch.setenv(name, str(tmp_path / folder))
    assert places.cache_folder() == tmp_path / cache and not places.is_temporary()
    assert (tmp_path / cache).stat().st_mode & 0o777 == 0o700
    assert places.baseline_folder() == tmp_path / baselines
    assert os.listdir(tmp_path / cache) == [places.TAG]


@pytest.mark.slow
@pytest.mark.parametrize("days", [0, 1000])
def test_a_temporary_cache_takes_nothing_beside_it(tmp_path, monkeypatch, days):
    before = foreign_files(tmp_path, days)
    words = [sys.executable, "-c", "from discmech.integrators.places import *; cache_folder()"]
    more = {"TMPDIR": str(tmp_path), "DISCMECH_CACHE": str(tmp_path / "notes.txt")}
    assert subprocess.run(words, env=os.environ | more).returncode == 0
    check_untouched(tmp_path, before)
    assert set(files_in(tmp_path)) == set(before)  # it is gone with its process


def test_a_user_file_that_goes_elsewhere_does_not_take_the_cache_along(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("DISCMECH_CACHE", ".")
    places.settle()
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert places.cache_folder() == tmp_path / "discmech-cache"
