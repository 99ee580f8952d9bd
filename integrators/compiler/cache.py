"""The user's private folder of generated files: nothing is derived or compiled twice.

The files there are run as code. So one is trusted only if nobody else can have written it and if it
still has the content that was written: every file begins with the digest of its name and content.
"""

from __future__ import annotations

import atexit
import hashlib
import logging
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path

from ..errors import BadInput
from ..files import draft_folder, encoded, sweep, write_atomically

_LOG = logging.getLogger("discmech")
#: the environment variable by which a process names its temporary folder to the processes it starts
_TEMPORARY = "DISCMECH_TEMPORARY_CACHE"
DAY = 86400.0
KEPT = 90 * DAY  # an unused file is removed after so many seconds
_SEAL = b"discmech "
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
#: folders of the cache whose content cannot be generated again
_NOT_PRUNED = ("baselines", "results")


@cache  # once a process
def say_once(sentence: str) -> None:
    """Warn the user once, through the logger "discmech" (by default on standard error)."""
    _LOG.warning("discmech: %s", sentence)


def cache_folder() -> Path:
    """Return the folder to write to: DISCMECH_CACHE, or discmech in the user's cache folder.

    The folder is made private. If it cannot be written to, this is a temporary folder that is
    removed when the process ends. Raises `BadInput` for a folder that other users own or can write
    to: they could make this user run their code.
    """
    folder = _chosen()
    return folder if folder is not None and _usable(folder, os.W_OK) else _temporary_folder()


def cache_folders() -> tuple[Path, ...]:
    """Return the folders to read: the one to write to, then the chosen one if it is read-only."""
    written, chosen = cache_folder(), _chosen()
    if chosen is None or written == chosen or not _usable(chosen, os.R_OK):
        return (written,)
    return written, chosen


def is_temporary() -> bool:
    """Return True if the cache is a temporary folder that is removed when this process ends."""
    return cache_folder() != _chosen()


def _chosen() -> Path | None:
    """Return the folder that the environment names, or None for a user without a home."""
    if chosen := os.environ.get("DISCMECH_CACHE"):
        return Path(chosen)
    try:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    except RuntimeError:
        return None
    return Path(base) / "discmech"


def _usable(folder: Path, how: int) -> bool:
    """Return True if the folder exists or can be made, and allows the access `how`."""
    try:
        make_private(folder)
        _refuse_others(folder)
        return os.access(folder, how | os.X_OK)
    except OSError:
        return False


def make_private(folder: Path) -> None:
    """Make a folder and its missing parents, with access for this user alone."""
    if not folder.is_dir():
        if folder.parent != folder:
            make_private(folder.parent)
        folder.mkdir(mode=0o700, exist_ok=True)


def _refuse_others(folder: Path) -> None:
    if why := _whose(found := folder.stat()):
        others = found.st_mode & _OTHERS_WRITE
        raise BadInput(
            f"the cache folder {folder} is not used, because {why}, and what lies there is run as "
            f"code: {f'say chmod go-w {folder}, or ' if others else ''}name a folder of your own "
            "in DISCMECH_CACHE."
        )


def of_others(path: Path) -> bool:
    """Return True if another user put a file or folder there, or can write into it."""
    return bool(_whose(path.stat()))


def _whose(found: os.stat_result) -> str:
    """Return why a file or folder is not the user's alone, or "" if it is."""
    if not hasattr(os, "geteuid"):  # permissions are not given as bits here
        return ""
    if found.st_mode & _OTHERS_WRITE:
        return "others can write into it"
    own = found.st_uid in (0, os.geteuid())
    return "" if own else f"it belongs to another user ({found.st_uid})"


@cache
def _temporary_folder() -> Path:
    """Return a folder for this process and those it starts; it is removed when this one ends."""
    given = os.environ.get(_TEMPORARY)
    if given and Path(given).is_dir():
        with suppress(BadInput):
            _refuse_others(Path(given))
            return Path(given)
    temporary, own = Path(tempfile.gettempdir()), os.getpid()
    sweep(temporary)
    folder = draft_folder(temporary)
    os.environ[_TEMPORARY] = str(folder)

    def remove() -> None:
        if os.getpid() == own:
            shutil.rmtree(folder, ignore_errors=True)

    atexit.register(remove)
    where = _chosen() or "there is no home folder"
    say_once(
        f"the cache folder ({where}) cannot be written to: what is made now is not kept for the "
        "next run; DISCMECH_CACHE names another folder."
    )
    return folder


#: folders whose text is part of the equations, so that the key of every kernel holds it already
IN_EQUATIONS = ("scenes", "rules")
#: the exceptions: machine code holds the numbers of Gauss and Lobatto nodes, but the text of a
#: kernel gives only how many nodes there are
IN_TABLES = ("quadrature.py",)


@cache
def sources() -> str:
    """Return the digest of our own generating sources: changed mathematics makes new files."""
    files = sorted(Path(__file__).parents[1].rglob("*.py"))
    return digest(*(p.read_bytes() for p in files
                    if p.parent.name not in IN_EQUATIONS or p.name in IN_TABLES))  # fmt: skip


def digest(*parts: str | bytes) -> str:
    """Return a name that depends on all the parts (24 hexadecimal digits of SHA-256)."""
    whole = b"\0".join(encoded(part) if isinstance(part, str) else part for part in parts)
    return hashlib.sha256(whole).hexdigest()[:24]


def seal(path: Path, content: str | bytes) -> None:
    """Write a file behind the digest of its name and content; raises `OSError` if it cannot."""
    make_private(path.parent)
    content = content.encode() if isinstance(content, str) else content
    write_atomically(path, _seal(path.name, content) + content)


def unsealed(path: Path) -> bytes | None:
    """Return the content that `seal` wrote, or None if the file is missing or unreadable.

    Raises `Damaged` if the digest is wrong, or if another user owns the file or can write to it.
    """
    try:
        with path.open("rb") as file:
            whose, found = _whose(os.fstat(file.fileno())), file.read()
    except OSError:
        return None
    if whose:
        raise Damaged(path)
    head, newline, content = found.partition(b"\n")
    earlier = hashlib.sha256(content).hexdigest().encode()  # older seals cover only the content
    if newline and head + newline in (_seal(path.name, content), earlier + newline):
        return content
    raise Damaged(path)


class Damaged(Exception):
    """A cached file whose content is not what was written; its argument is the path."""


def _seal(name: str, content: bytes) -> bytes:
    whole = hashlib.sha256(name.encode() + b"\0" + content)
    return _SEAL + whole.hexdigest().encode() + b"\n"


def cached(name: str, build: Callable[[], bytes]) -> bytes:
    """Return the content of a cached file; build it if it is missing or damaged.

    If the disk cannot store it, it is built again the next time.
    """
    found = find(name)
    if found is None:
        found = build()
        keep(name, found)
    return found


def cached_text(name: str, build: Callable[[], str]) -> str:
    """Return `cached` for a text."""
    return cached(name, lambda: build().encode()).decode()


def find(name: str) -> bytes | None:
    """Return the content of a cached file, or None if it is missing or damaged."""
    for folder in cache_folders():
        path = folder / name
        try:
            content = unsealed(path)
        except Damaged:
            say_once(
                f"a file of the cache was damaged or is not yours alone, and is made anew ({path})."
            )
            continue
        if content is not None:
            _asked_for(path)
            return content
    return None


def keep(name: str, content: bytes) -> None:
    """Write a file of the cache; if that fails, warn once."""
    folder = cache_folder()
    try:
        seal(folder / name, content)
    except OSError as error:
        say_once(
            f"the cache folder {folder} cannot be written to ({error.strerror or error}): what is "
            "made now is made again by the next run."
        )
    prune()


def _asked_for(path: Path) -> None:
    """Record, at most once a day, that a file is in use."""
    with suppress(OSError):
        if time.time() - path.stat().st_mtime > DAY:
            os.utime(path)


@cache  # checked once in a process
def prune() -> None:
    """Remove files that nobody used for 90 days, and drafts of killed processes.

    This happens once a day. Results have their own rule (`studies.core.store`); baselines stay.
    """
    folder, now = cache_folder(), time.time()
    stamp = folder / "pruned"
    with suppress(OSError):
        if stamp.exists() and now - stamp.stat().st_mtime < DAY:
            return
        stamp.touch()
        for path in _files(folder):
            age = now - path.stat().st_mtime
            made_again = path.relative_to(folder).parts[0] not in _NOT_PRUNED
            if made_again and age > KEPT:
                path.unlink(missing_ok=True)
        for place in (folder, *filter(Path.is_dir, folder.iterdir())):
            sweep(place)


def _files(folder: Path) -> Iterator[Path]:
    for path in folder.rglob("*"):
        if path.is_file() and not path.is_symlink():
            yield path
