"""References computed for a user are kept in the user's cache folder, named by their content."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from discmech.integrators.compiler import cache_folder

from .failures import Damaged
from .result import Solution
from .store import Table, read, write


def folder() -> Path:
    """references/ in the folder of what is generated."""
    place = cache_folder() / "references"
    place.mkdir(mode=0o700, exist_ok=True)
    return place


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
