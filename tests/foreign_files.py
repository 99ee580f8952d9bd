"""Somebody else's files, with names like ours: every command has to leave them alone."""

from __future__ import annotations

import os
import sqlite3
import time
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

NAMES = (
    "notes.txt", "rule.py", "code.o", "x.new", "run1.new", "pruned", "index.html", "order.json",
    "CACHEDIR.TAG", "figures/mine.svg", "tables/mine.csv", "results/ab/c", "kernels/kernel.py",
    "results/store.sqlite-wal", "results/store.sqlite-shm", "results/store-1.sqlite",
    "references/harmonic_0123456789abcdef01234567.json", "notebooks/0123456789abcdef.py",
    "baselines/thesis/order.json", "discmech-cache-999999-mine/notes.txt",
    ".discmech-draft-notes/notes.txt", ".discmech-draft-999999-mine/notes.txt",
)  # fmt: skip


class Seen(NamedTuple):
    """What is known of a file."""

    content: bytes
    modified: int
    mode: int


def foreign_files(folder: Path, days: float) -> dict[str, Seen]:
    """Write the files, which nobody touched for so many days; return what is known of them."""
    for name in NAMES:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(f"{name} of somebody else")
    with closing(sqlite3.connect(folder / "results" / "store.sqlite")) as file:
        file.execute("CREATE TABLE thesis (chapter TEXT)")
    then = time.time() - days * 86400
    for name in files_in(folder):
        os.utime(folder / name, (then, then))
    return files_in(folder)


def files_in(folder: Path) -> dict[str, Seen]:
    return {str(path.relative_to(folder)): _seen(path)
            for path in sorted(folder.rglob("*")) if path.is_file()}  # fmt: skip


def _seen(path: Path) -> Seen:
    known = path.stat()
    return Seen(path.read_bytes(), known.st_mtime_ns, known.st_mode)


def check_untouched(folder: Path, before: dict[str, Seen]) -> None:
    """Assert that each of these files is what it was, to the byte, and no older."""
    now = files_in(folder)
    changed = [name for name, seen in before.items() if now.get(name) != seen]
    assert not changed, f"other people's files are gone or changed: {changed}"
