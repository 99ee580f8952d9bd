"""Which files are ours: an output replaces nothing else.

A file is ours by its content: JSON by its keys, a page and a badge by their heads, exported code by
its seal. The files in a folder of results are those that its manifest lists, as long as nobody
changed them.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable
from pathlib import Path

from discmech.integrators import BadInput

MANIFEST = ".discmech-files.json"
HEAD = 4096  # bytes in which the mark of a page stands
_BADGE = b"<svg ", b'aria-label="discmech: '
#: beginnings of pages, badges and the gallery, and what else their heads have
_MARKS = (
    (b"<!doctype html>", b'<meta name="generator" content="discmech">'),
    _BADGE,
    (b"# gallery: integrators that people use", b""),
)
#: keys of our results: a run and a reference, a study, and the lists
_KEYS = ({"schema", "scene", "x", "mu"}, {"study", "verdict", "cases"},
         {"scenes", "rules", "groupoids", "studies"}, {"control", "band", "pullback"},
         {"gallery", "absent"}, {"command", "rule", "verdict", "classes"})  # fmt: skip


def refuse_foreign(path: Path, shown: str) -> None:
    """Raise `BadInput` for a file with a content that is not ours; shown: its name in words."""
    if path.is_file() and path.stat().st_size and not _is_ours(path):
        raise BadInput(
            f"{shown} is there, and is no such result of discmech, or was changed since: name "
            "another file, or move it away."
        )


def is_badge(path: Path) -> bool:
    """True if a file is a badge that discmech wrote."""
    return _has(_head(path), _BADGE)


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(HEAD)


def _has(head: bytes, mark: tuple[bytes, bytes]) -> bool:
    return head.lstrip().lower().startswith(mark[0]) and mark[1] in head


def _is_ours(path: Path) -> bool:
    head = _head(path)
    if any(_has(head, mark) for mark in _MARKS):
        return True
    if b"(seal " in head:
        from discmech.integrators.extensions.export import as_written

        return as_written(path.read_text(encoding="utf-8", errors="replace"))
    if head.lstrip()[:1] not in (b"{", b"["):
        return False
    try:
        content = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        return False
    if isinstance(content, list):
        content = content[0] if content else None
    return isinstance(content, dict) and any(keys <= content.keys() for keys in _KEYS)


def manifest(folder: Path) -> str:
    """Return the manifest of all files in a folder."""
    names = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return json.dumps({str(path.relative_to(folder)): _digest(path) for path in names}, indent=1)


def ours_in(folder: Path) -> set[str]:
    """Return the names of a folder's files that are as its manifest has them, and its own name."""
    try:
        told = json.loads((folder / MANIFEST).read_text(encoding="utf-8")).items()
    except (OSError, ValueError, AttributeError):
        return set()
    # a manifest that was changed may name files elsewhere
    within = ((name, seen) for name, seen in told
              if (folder / name).resolve().is_relative_to(folder.resolve()))  # fmt: skip
    return {MANIFEST, *(name for name, seen in within if _digest(folder / name) == seen)}


def refuse_foreign_in(folder: Path, names: Iterable[str]) -> None:
    """Raise `BadInput` if one of these names in a folder is taken by what is not ours."""
    ours = ours_in(folder)
    for name in names:
        path = folder / name
        parts = [part for part in path.parents if part.is_relative_to(folder) and part != folder]
        blocked = [part for part in parts
                   if part.is_symlink() or (part.exists() and not part.is_dir())]  # fmt: skip
        if blocked or (os.path.lexists(path) and name not in ours):
            raise BadInput(
                f"{blocked[0] if blocked else path} is there, and is not as discmech wrote it: "
                "move it away, or name another --folder."
            )


def _digest(path: Path) -> str | None:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return None
