"""The user's cache of computed references, in files named by their content."""

from __future__ import annotations

import contextlib
import hashlib
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from ..failures import Damaged
from .result import Solution
from .store import Table, read, write

LONGEST = 60  # longest part of a scene's name in a file name, which the digest makes unique
_NAME = re.compile(r".*_[0-9a-f]{24}\.json")


def folders() -> list[Path]:
    """Return the folders to read; the first is the one to write to (`places.cache_folders`)."""
    from discmech.integrators.places import cache_folders

    return [place / "references" for place in cache_folders()]


@cache
def _program() -> str:
    """Return the digest of this package: other code makes other files."""
    here = Path(__file__).parent.parent
    return hashlib.sha256(b"".join(p.read_bytes() for p in sorted(here.rglob("*.py")))).hexdigest()


def name_of(scene: str, key: str) -> str:
    """Return the name of the file with the references of a scene with that fingerprint."""
    digest = hashlib.sha256((key + _program()).encode()).hexdigest()[:24]
    return f"{scene[:LONGEST]}_{digest}.json"


def kept(scene: str, key: str) -> Table:
    """Return the references computed before; a damaged file is reported once and ignored."""
    from discmech.integrators.files import asked_for
    from discmech.integrators.places import of_others, say_once

    for place in folders():
        path = place / name_of(scene, key)
        try:
            if of_others(path):
                raise Damaged(f"{path.name} is not yours alone")
            table = read(path)
        except FileNotFoundError:
            continue
        except (Damaged, OSError):
            say_once(f"a reference in the cache was damaged, and is computed anew ({path}).")
            continue
        if table.key == key:
            asked_for(path)
            return table
    return Table(scene, key, ())


def keep(scene: str, key: str, rows: Iterable[Solution]) -> None:
    """Add solutions; a folder that cannot be written to is ignored."""
    from discmech.integrators.files import prune
    from discmech.integrators.places import make_private

    path = folders()[0] / name_of(scene, key)
    with contextlib.suppress(OSError):
        make_private(path.parent)
        write(path, kept(scene, key).with_rows(rows))
    prune(path.parent, _is_table)


def _is_table(path: Path) -> bool:
    """Return True if `write` wrote the file, as it is."""
    try:
        return bool(_NAME.fullmatch(path.name) and read(path))
    except Damaged:
        return False
