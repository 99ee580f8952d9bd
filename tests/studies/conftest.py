"""What the tests of the studies share: no trace is left in the user's cache."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def own_journal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Journals of unfinished studies go to the test's folder; compiled kernels stay shared."""
    folder = tmp_path / "cache"
    folder.mkdir()
    monkeypatch.setattr("discmech.studies.journal.cache_folder", lambda: folder)
