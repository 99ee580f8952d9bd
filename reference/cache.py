"""References computed for a user are kept in the user's cache folder, named by their content."""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from .failures import Damaged
from .result import Solution
from .store import Table, read, write


def folder() -> Path:
    """references/ in DISCMECH_CACHE, or in discmech in the user's cache folder, or a temporary one.

    The kernels' cache goes by the same rule; nothing is shared with it.
    """
    chosen = os.environ.get("DISCMECH_CACHE")
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    place = (Path(chosen) if chosen else Path(base) / "discmech") / "references"
    try:
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        if os.access(place, os.W_OK):
            return place
    except OSError:
        pass
    return _temporary()


@cache
def _temporary() -> Path:
    return Path(tempfile.mkdtemp(prefix="discmech-references-"))


@cache
def _program() -> str:
    """Digest of this package: other code makes other files."""
    here = Path(__file__).parent
    return hashlib.sha256(b"".join(p.read_bytes() for p in sorted(here.rglob("*.py")))).hexdigest()


def file_of(scene: str, key: str) -> Path:
    """Where the references of a scene with that fingerprint are."""
    digest = hashlib.sha256((key + _program()).encode()).hexdigest()[:24]
    return folder() / f"{scene}_{digest}.json"


def kept(scene: str, key: str) -> Table:
    """What was computed before; a damaged file counts as none."""
    try:
        table = read(file_of(scene, key))
        if table.key == key:
            return table
    except Damaged:
        pass
    return Table(scene, key, ())


def keep(scene: str, key: str, rows: Iterable[Solution]) -> None:
    """Add solutions; a folder that cannot be written to is no failure."""
    with contextlib.suppress(OSError):
        write(file_of(scene, key), kept(scene, key).with_rows(rows))
