"""The user's cache of computed references, in files named by their content."""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import logging
import os
import shutil
import tempfile
import time
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from ..failures import Damaged
from .result import Solution
from .store import Table, read, write

LONGEST = 60  # longest part of a scene's name in a file name, which the digest makes unique
DAY = 86400.0


def folder() -> Path:
    """Return references/ in DISCMECH_CACHE or in the user's cache folder, or a temporary folder.

    The kernels' cache follows the same rule, but refuses a folder that others can write to. No code
    is shared with it. Here such a folder is ignored.
    """
    chosen = _chosen()
    return chosen if chosen is not None and _is_safe(chosen, os.W_OK) else _temporary()


def folders() -> list[Path]:
    """Return the folders to read: the one to write to, then the chosen one if it is read-only."""
    written, chosen = folder(), _chosen()
    if chosen is None or written == chosen or not _is_safe(chosen, os.R_OK):
        return [written]
    return [written, chosen]


def _chosen() -> Path | None:
    if chosen := os.environ.get("DISCMECH_CACHE"):
        return Path(chosen) / "references"
    try:
        base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    except RuntimeError:  # a user without a home
        return None
    return Path(base) / "discmech" / "references"


def _is_safe(place: Path, how: int) -> bool:
    """Return True if it can be read or written, and nobody else can write there."""
    try:
        for made in (place.parent.parent, place.parent, place):
            made.mkdir(mode=0o700, parents=True, exist_ok=True)
        private = _is_private(place) and _is_private(place.parent)
        return private and os.access(place, how) and os.access(place, os.X_OK)
    except OSError:
        return False


def _is_private(place: Path) -> bool:
    if not hasattr(os, "geteuid"):
        return True
    found = place.stat()
    return found.st_uid in (0, os.geteuid()) and not found.st_mode & 0o022


@cache
def _temporary() -> Path:
    _say_once(
        "references are not kept for the next run: the cache folder cannot be written to, or "
        "others can write into it; DISCMECH_CACHE names another one."
    )
    made = Path(tempfile.mkdtemp(prefix=f"discmech-cache-{os.getpid()}-references-"))
    atexit.register(_remove, made, os.getpid())
    return made


def _remove(made: Path, process: int) -> None:
    if os.getpid() == process:
        shutil.rmtree(made, ignore_errors=True)


@cache
def _program() -> str:
    """Return the digest of this package: other code makes other files."""
    here = Path(__file__).parent.parent
    return hashlib.sha256(b"".join(p.read_bytes() for p in sorted(here.rglob("*.py")))).hexdigest()


def file_of(scene: str, key: str) -> Path:
    """Return the file with the references of a scene with that fingerprint."""
    digest = hashlib.sha256((key + _program()).encode()).hexdigest()[:24]
    return folder() / f"{scene[:LONGEST]}_{digest}.json"


def kept(scene: str, key: str) -> Table:
    """Return the references computed before; a damaged file is reported once and ignored."""
    for place in folders():
        path = place / file_of(scene, key).name
        if not path.exists():
            continue
        try:
            table = read(path)
        except Damaged:
            _say_once(f"a reference in the cache was damaged, and is computed anew ({path}).")
            continue
        if table.key == key:
            with contextlib.suppress(OSError):
                if time.time() - path.stat().st_mtime > DAY:
                    os.utime(path)  # unused files are removed after 90 days
            return table
    return Table(scene, key, ())


def keep(scene: str, key: str, rows: Iterable[Solution]) -> None:
    """Add solutions; a folder that cannot be written to is ignored."""
    with contextlib.suppress(OSError):
        write(file_of(scene, key), kept(scene, key).with_rows(rows))


@cache
def _say_once(sentence: str) -> None:
    logging.getLogger("discmech").warning("discmech: %s", sentence)
