"""Write to a new folder, then rename: a folder of results is the old or the new one, never half."""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from discmech.integrators.files import DRAFT, READY, draft_folder, left, sweep

from ..core.ours import MANIFEST, manifest, ours_in, refuse_foreign_in

_ORDER = "order.json"  # the names of ready files in the order in which they move, and of old ones


@contextmanager
def published(folder: Path, last: str) -> Iterator[Path]:
    """Yield a new folder to write into; if the block succeeds, it replaces our files in `folder`.

    A folder that contains only files of an earlier call is exchanged for the new one in a single
    system call. Others' files stay: then the new ones are moved one by one, `last` last, because it
    refers to the others, and earlier ones are removed; if that is interrupted, the next call
    completes it first. If anything fails before, the old files are unchanged. Raises `BadInput`
    where a new file would replace one that is not as an earlier call wrote it.
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
        (new / MANIFEST).write_text(manifest(new), encoding="utf-8")
        names = [str(p.relative_to(new)) for p in sorted(new.rglob("*")) if p.is_file()]
        refuse_foreign_in(folder, names)
        ours = ours_in(folder)
        if not (new.parent == folder.parent and _is_all(folder, ours) and _exchanged(new, folder)):
            names.sort(key=lambda name: name == last)
            _move(new, folder, names, sorted(ours - set(names)))
    finally:
        shutil.rmtree(new, ignore_errors=True)


def _is_all(folder: Path, ours: set[str]) -> bool:
    """Return True if a folder has these files, and folders for them, and nothing else."""
    parts = {str(parent) for name in ours for parent in Path(name).parents}
    paths = {str(path.relative_to(folder)) for path in folder.rglob("*")}
    return paths <= ours | parts and not any(p.is_symlink() for p in folder.rglob("*"))


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


def _move(new: Path, folder: Path, names: list[str], stale: list[str]) -> None:
    """Move files into the folder and remove others, in a way that a later run can complete."""
    ready = folder / new.name.replace(DRAFT, READY)
    (new / _ORDER).write_text(json.dumps({"move": names, "remove": stale}), encoding="utf-8")
    os.rename(new, ready)  # from here on it will be completed
    _complete(ready, folder)


def _complete(ready: Path, folder: Path) -> None:
    order = ready / _ORDER
    told = json.loads(order.read_text(encoding="utf-8")) if order.exists() else {}
    for name in told.get("move", ()):
        if (ready / name).exists():  # otherwise it was moved before
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            os.replace(ready / name, folder / name)
    for name in told.get("remove", ()):
        (folder / name).unlink(missing_ok=True)
        with suppress(OSError):  # others' files are in it
            (folder / name).parent.rmdir()
    shutil.rmtree(ready, ignore_errors=True)
