"""Files that are written whole, and what is removed of them: only what shows that we wrote it.

What is being written has a name of its own until it is finished: one prefix, the machine and the
process that writes it. A draft is removed only by this name, and only after its process has ended.
An old file of the cache is removed only if its content says that it is ours. No other file is
removed for its age, its name or its place.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path

#: the beginning of the name of what is being written, and of a folder that is finished and only has
#: to be moved to its place
DRAFT, READY = ".discmech-draft-", ".discmech-ready-"
_NAME = re.compile(r"\.discmech-(?:draft|ready)-([0-9a-f]{8})-([0-9]+)-\w+")
DAY = 86400.0  # of another machine nobody can ask which processes run: its drafts go after a day
KEPT = 90 * DAY  # an unused file of the cache is removed after so many seconds


def write_atomically(path: Path, content: str | bytes, mode: int = 0o600) -> None:
    """Write a draft beside, then rename it, so that no reader or crash leaves half a file.

    mode: the permissions of the file. Raises `OSError` if the disk does not take it.
    """
    handle, draft = tempfile.mkstemp(prefix=_prefix(), dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(encoded(content) if isinstance(content, str) else content)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(draft, mode)
        os.replace(draft, path)
    except BaseException:
        Path(draft).unlink(missing_ok=True)
        raise


def encoded(text: str) -> bytes:
    """Return a text in UTF-8; what it cannot write, as a byte of a file's name, as \\udc80."""
    return text.encode("utf-8", "backslashreplace")


def draft_folder(where: Path) -> Path:
    """Return a new folder there with a draft's name, for this user alone."""
    return Path(tempfile.mkdtemp(prefix=_prefix(), dir=where))


def sweep(folder: Path) -> None:
    """Remove the drafts in a folder whose processes have ended."""
    for draft in left(folder, DRAFT):
        if draft.is_dir() and not draft.is_symlink():
            shutil.rmtree(draft, ignore_errors=True)
        else:
            with suppress(OSError):
                draft.unlink()


def asked_for(path: Path) -> None:
    """Record, at most once a day, that a file of the cache is in use."""
    with suppress(OSError):
        if time.time() - path.stat().st_mtime > DAY:
            os.utime(path)


@cache  # checked once in a process
def prune(folder: Path, is_ours: Callable[[Path], bool]) -> None:
    """Remove drafts of ended processes and, of our files in a folder, those unused for 90 days.

    This happens once a day. is_ours: whether a file has the content that we wrote under its name.
    """
    now, stamp = time.time(), folder / "pruned"
    with suppress(OSError):
        if stamp.exists() and now - stamp.stat().st_mtime < DAY:
            return
        stamp.touch()
        sweep(folder)
        for path in list(folder.iterdir()):
            is_file = path.is_file() and not path.is_symlink()
            if is_file and now - path.stat().st_mtime > KEPT and is_ours(path):
                path.unlink(missing_ok=True)


def left(folder: Path, prefix: str) -> Iterator[Path]:
    """Yield what lies in a folder under a draft's name and has no process any more."""
    for path in list(folder.glob(f"{prefix}*")):
        known = _NAME.fullmatch(path.name)
        if known and _has_ended(path, known[1], int(known[2])):
            yield path


def _has_ended(path: Path, machine: str, process: int) -> bool:
    if machine != _machine() or os.name == "nt":  # there os.kill would do what it says
        with suppress(OSError):
            return time.time() - path.lstat().st_mtime > DAY
        return False
    if process == os.getpid():
        return False
    try:
        os.kill(process, 0)
    except (ProcessLookupError, OverflowError):
        return True
    except OSError:  # it runs, as another user
        return False
    return False


def _prefix() -> str:
    return f"{DRAFT}{_machine()}-{os.getpid()}-"


@cache
def _machine() -> str:
    """Return a short name of this machine: several may write into one folder of a shared disk."""
    import platform

    return hashlib.sha256(platform.node().encode()).hexdigest()[:8]
