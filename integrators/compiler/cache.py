"""A private folder of the user's for what is generated: nothing is derived or compiled twice.

What lies there is run as code, so it is believed only where nobody else can have put it, and as far
as it is what was written: every file begins with the digest of its name and of what follows.
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

_LOG = logging.getLogger("discmech")
#: where a process tells those that it starts which temporary folder serves in place of a cache
_TEMPORARY = "DISCMECH_TEMPORARY_CACHE"
DAY = 86400.0
KEPT = 90 * DAY  # what nobody asked for in so many seconds is removed
_SEAL = b"discmech "
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
#: folders of the cache that hold what cannot be made again
_NOT_PRUNED = ("baselines", "results")


@cache  # once a process
def say_once(sentence: str) -> None:
    """Tell the user: on standard error, unless the program that uses us has other plans."""
    _LOG.warning("discmech: %s", sentence)


def cache_folder() -> Path:
    """Where to write: DISCMECH_CACHE, or discmech in the user's cache folder, made private.

    A temporary folder, which goes with the process, where that one cannot be written to. Raises
    `BadInput` for a folder that others own or can write to: they could have this user run their
    code.
    """
    folder = _chosen()
    return folder if folder is not None and _usable(folder, os.W_OK) else _temporary_folder()


def cache_folders() -> tuple[Path, ...]:
    """Where to look: the folder to write to, and the chosen one where that can only be read."""
    written, chosen = cache_folder(), _chosen()
    if chosen is None or written == chosen or not _usable(chosen, os.R_OK):
        return (written,)
    return written, chosen


def is_temporary() -> bool:
    """Whether what is written to the cache goes with this process."""
    return cache_folder() != _chosen()


def _chosen() -> Path | None:
    """The folder that is asked for; None for a user without a home."""
    if chosen := os.environ.get("DISCMECH_CACHE"):
        return Path(chosen)
    try:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    except RuntimeError:
        return None
    return Path(base) / "discmech"


def _usable(folder: Path, how: int) -> bool:
    """Whether the folder is there, or can be made, and can be read or written."""
    try:
        make_private(folder)
        _refuse_others(folder)
        return os.access(folder, how | os.X_OK)
    except OSError:
        return False


def make_private(folder: Path) -> None:
    """Make a folder and those above it, for the user alone where they are new."""
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


def _whose(found: os.stat_result) -> str:
    """Why a file or folder is not the user's alone; empty where it is."""
    if not hasattr(os, "geteuid"):  # its rights are no bits
        return ""
    if found.st_mode & _OTHERS_WRITE:
        return "others can write into it"
    own = found.st_uid in (0, os.geteuid())
    return "" if own else f"it belongs to another user ({found.st_uid})"


@cache
def _temporary_folder() -> Path:
    """One for this process and those that it starts; it goes when this one ends."""
    given = os.environ.get(_TEMPORARY)
    if given and Path(given).is_dir():
        with suppress(BadInput):
            _refuse_others(Path(given))
            return Path(given)
    _sweep_temporary()
    folder, own = Path(tempfile.mkdtemp(prefix=f"discmech-cache-{os.getpid()}-")), os.getpid()
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


def _sweep_temporary() -> None:
    """Remove the folders of processes that were killed."""
    for folder in Path(tempfile.gettempdir()).glob("discmech-cache-*-*"):
        number = folder.name.split("-")[2]
        if (
            number.isdecimal()
            and not Path("/proc", number).exists()
            and Path("/proc/self").exists()
        ):
            shutil.rmtree(folder, ignore_errors=True)


#: folders whose text is in the equations that it makes, and so in each name by itself
IN_EQUATIONS = ("scenes", "rules")
#: but not these: Gauss and Lobatto nodes are numbers in machine code, of which no text says more
#: than how many there are
IN_TABLES = ("quadrature.py",)


@cache
def sources() -> str:
    """Digest of all of our own text that generates: changed mathematics makes new files."""
    files = sorted(Path(__file__).parents[1].rglob("*.py"))
    return digest(*(p.read_bytes() for p in files
                    if p.parent.name not in IN_EQUATIONS or p.name in IN_TABLES))  # fmt: skip


def digest(*parts: str | bytes) -> str:
    """A name that no other text has."""
    whole = b"\0".join(part.encode() if isinstance(part, str) else part for part in parts)
    return hashlib.sha256(whole).hexdigest()[:24]


def write_atomically(path: Path, content: str | bytes) -> None:
    """Write to another name, then rename: nobody ever sees half a file, even after a crash."""
    handle, draft = tempfile.mkstemp(dir=path.parent, prefix=path.name[:40], suffix=".new")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content.encode() if isinstance(content, str) else content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(draft, path)
    except BaseException:
        Path(draft).unlink(missing_ok=True)
        raise


def seal(path: Path, content: str | bytes) -> None:
    """Write a file behind the digest of its name and content; raises `OSError` if it cannot."""
    make_private(path.parent)
    content = content.encode() if isinstance(content, str) else content
    write_atomically(path, _seal(path.name, content) + content)


def unsealed(path: Path) -> bytes | None:
    """What `seal` wrote there; None if there is nothing, or it cannot be read.

    Raises `Damaged` for anything else, and for what another user put or can put there.
    """
    try:
        with path.open("rb") as file:
            whose, found = _whose(os.fstat(file.fileno())), file.read()
    except OSError:
        return None
    if whose:
        raise Damaged(path)
    head, newline, content = found.partition(b"\n")
    earlier = hashlib.sha256(content).hexdigest().encode()  # seals of before: of the content alone
    if newline and head + newline in (_seal(path.name, content), earlier + newline):
        return content
    raise Damaged(path)


class Damaged(Exception):
    """A file that is not what was written; its argument is the path."""


def _seal(name: str, content: bytes) -> bytes:
    whole = hashlib.sha256(name.encode() + b"\0" + content)
    return _SEAL + whole.hexdigest().encode() + b"\n"


def cached(name: str, build: Callable[[], bytes]) -> bytes:
    """The content of a file of the cache, built if it is not there or damaged.

    A disk that takes nothing costs no more than building it again another time.
    """
    found = find(name)
    if found is None:
        found = build()
        keep(name, found)
    return found


def cached_text(name: str, build: Callable[[], str]) -> str:
    """`cached` of a text."""
    return cached(name, lambda: build().encode()).decode()


def find(name: str) -> bytes | None:
    """The content of a file of the cache; None if it is not there, or damaged."""
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
    """Write a file of the cache, where that can be."""
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
    """Note, at most once a day, that a file is in use."""
    with suppress(OSError):
        if time.time() - path.stat().st_mtime > DAY:
            os.utime(path)


@cache  # a process looks once
def prune() -> None:
    """Remove what nobody asked for in 90 days, and what killed processes left a day ago.

    Looked at once a day. Results have a rule of their own (`studies.core.store`), and baselines
    stay.
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
            if (made_again and age > KEPT) or (path.suffix == ".new" and age > DAY):
                path.unlink(missing_ok=True)


def _files(folder: Path) -> Iterator[Path]:
    for path in folder.rglob("*"):
        if path.is_file() and not path.is_symlink():
            yield path
