"""What the tests of the studies share: the command, and no trace in the user's cache."""

from __future__ import annotations

import sqlite3
import sys
from collections.abc import Callable
from contextlib import closing
from functools import cached_property
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from discmech.studies.command.entry import main
from discmech.studies.core import decisions


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Results are kept in the test's folder; compiled kernels stay shared."""
    folder = tmp_path / "cache" / "discmech-cache"
    folder.mkdir(parents=True)
    for name, place in {"store.cache": folder, "baseline.baseline": tmp_path / "baselines"}.items():
        monkeypatch.setattr(f"discmech.studies.core.{name}_folder", lambda place=place: place)


@pytest.fixture(autouse=True)
def as_it_is(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """A failing case is made smaller, which takes as long again, where a file has `SMALLER`."""
    if not hasattr(request.module, "SMALLER"):
        monkeypatch.setattr("discmech.studies.core.running.shrunk", lambda *_: {})
        monkeypatch.setattr("discmech.studies.user.assertions.smallest", lambda *_: None)


@pytest.fixture(autouse=True)
def no_decision_in_a_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a test measures asks no decision in a function that remembers its results."""
    made = decisions.Decision

    def watched(*given: Any) -> Any:
        frame: FrameType | None = sys._getframe(1)
        while frame is not None and frame.f_code.co_name != "measured_case":
            assert not remembers(frame), f"{given[0]}, in a cache of {frame.f_code.co_qualname}"
            frame = frame.f_back
        return made(*given)

    monkeypatch.setattr(decisions, "Decision", watched)


def remembers(frame: FrameType) -> bool:
    """Return True if the function of a frame keeps its results, by a name in its module."""
    first, *others = frame.f_code.co_qualname.split(".")
    thing = frame.f_globals.get(first)
    for name in others:
        thing = getattr(thing, "__dict__", {}).get(name)
    return hasattr(thing, "cache_clear") or isinstance(thing, cached_property)


@pytest.fixture
def rows(tmp_path: Path) -> Callable[..., list[tuple[Any, ...]]]:
    """What the store's file answers to a statement, by default the names of measurements."""
    file = tmp_path / "cache" / "discmech-cache" / "results" / "store.sqlite"

    def asked(
        statement: str = "SELECT name FROM entry WHERE kind = 'measurement'", *given: Any
    ) -> list[tuple[Any, ...]]:
        with closing(sqlite3.connect(file)) as store, store:
            return store.execute(statement, given).fetchall()

    return asked


@pytest.fixture
def ask(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """(exit code, standard output, standard error) of the command, argparse's errors included."""

    def asked(*words: str) -> tuple[int, str, str]:
        try:
            code = main(list(words))
        except SystemExit as stop:
            code = stop.code
        shown = capsys.readouterr()
        return code, shown.out, shown.err

    return asked
