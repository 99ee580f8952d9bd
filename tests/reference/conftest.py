"""What the tests of the references share: the user's cache is neither read nor written."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def own_references(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Computed references go to the test's folder."""
    folder = tmp_path / "references"
    folder.mkdir()
    monkeypatch.setattr("discmech.reference.answer.cache.folders", lambda: [folder])
    return folder
