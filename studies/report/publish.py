"""Write to a new folder, then rename: a folder of results is the old or the new one, never half."""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from discmech.integrators.files import DRAFT, READY, draft_folder, left, sweep

_ORDER = "order.json"  # the names of ready entries in the order in which they move


@contextmanager
def published(folder: Path, last: str) -> Iterator[Path]:
    """Yield a new folder to write into; if the block succeeds, it replaces `folder`.

    A folder that contains only such published entries is exchanged for the new one in a single
    system call. Other entries of `folder` stay: then the new ones are moved one by one, `last`
    last, because it refers to the others; if that is interrupted, the next call completes it first.
    If anything fails before, the old entries are unchanged.
    """
    folder = Path(folder).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    for ready in left(folder, READY):
        _complete(ready, folder)
    sweep(folder)
    sweep(folder.parent)
    # beside the target, or inside it if that has other files
    new = draft_folder(folder.parent if _may_be_exchanged(folder) else folder)
    try:
        yield new
        new.chmod(folder.stat().st_mode & 0o777)
        names = {entry.name for entry in new.iterdir()}
        others = {entry.name for entry in folder.iterdir()}
        if not (new.parent == folder.parent and others <= names and _exchanged(new, folder)):
            _move(new, folder, last)
    finally:
        shutil.rmtree(new, ignore_errors=True)


def _may_be_exchanged(folder: Path) -> bool:
    """Return True if the folder may be renamed: it is neither the current one nor a mount point."""
    here = Path.cwd()
    within = folder == here or folder in here.parents
    return not (within or os.path.ismount(folder)) and os.access(folder.parent, os.W_OK)


def _exchanged(one: Path, other: Path) -> bool:
    """Exchange the names of two folders; return False if the system cannot do that in one step."""
    if sys.platform != "linux":
        return False
    here, exchange = -100, 2  # AT_FDCWD, RENAME_EXCHANGE
    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (AttributeError, OSError):
        return False
    return not rename(here, os.fsencode(one), here, os.fsencode(other), exchange)


def _move(new: Path, folder: Path, last: str) -> None:
    """Move the entries into the folder in a way that a later run can complete."""
    names = sorted((entry.name for entry in new.iterdir()), key=lambda name: name == last)
    ready = folder / new.name.replace(DRAFT, READY)
    (new / _ORDER).write_text(json.dumps(names), encoding="utf-8")
    os.rename(new, ready)  # from here on it will be completed
    _complete(ready, folder)


def _complete(ready: Path, folder: Path) -> None:
    order = ready / _ORDER
    aside = draft_folder(folder)
    for name in json.loads(order.read_text(encoding="utf-8")) if order.exists() else ():
        source, target = ready / name, folder / name
        if not source.exists():  # it was moved before
            continue
        if target.is_dir() and not target.is_symlink():
            os.rename(target, aside / name)
        os.replace(source, target)
    for done in (ready, aside):
        shutil.rmtree(done, ignore_errors=True)
