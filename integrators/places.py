"""Where we keep what we make: a cache that carries our mark, and baselines beside it.

Both lie in the folder that DISCMECH_CACHE names, or in the user's usual ones. That folder may hold
anything; ours in it is one that nobody else can write into, for its files are run as code, and that
we made: only there is anything ever removed.
"""

from __future__ import annotations

import atexit
import logging
import os
import shutil
import stat
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path

from .errors import BadInput
from .files import DRAFT, draft_folder, sweep, write_atomically

_LOG = logging.getLogger("discmech")
#: the environment variable by which a process names its temporary folder to the processes it starts
_TEMPORARY = "DISCMECH_TEMPORARY_CACHE"
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
TAG = "CACHEDIR.TAG"  # by this file and its first line backup programs know a cache
#: the beginning of the file that says that a folder is ours
_OURS = b"Signature: 8a477f597d28d172789f06886806bc55\n# This is a cache of discmech"
_MARK = _OURS + b", which makes it again when it is deleted: https://bford.info/cachedir\n"


@cache  # once a process
def say_once(sentence: str) -> None:
    """Warn the user once, through the logger "discmech" (by default on standard error)."""
    _LOG.warning("discmech: %s", sentence)


def cache_folder() -> Path:
    """Return the cache to write to: discmech-cache in DISCMECH_CACHE or the user's cache folder.

    It is made private, and marked. If it cannot be written to, this is a temporary folder that is
    removed when the process ends. Raises `BadInput` for a folder that other users own or can write
    to, as they could make this user run their code, and for one with files and without our mark.
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


def baseline_folder() -> Path | None:
    """Return the folder of baselines, which no cleared cache takes along; None without a home."""
    return _named("discmech-baselines", "XDG_DATA_HOME", ".local/share")


def settle() -> None:
    """Make the folder that the environment names absolute: a user's file may go to another one."""
    if named := os.environ.get("DISCMECH_CACHE"):
        os.environ["DISCMECH_CACHE"] = os.path.abspath(named)


def _chosen() -> Path | None:
    return _named("discmech-cache", "XDG_CACHE_HOME", ".cache")


def _named(name: str, variable: str, usual: str) -> Path | None:
    """Return the folder of this name in the one that the environment names, or in the usual one."""
    base = os.environ.get("DISCMECH_CACHE") or os.environ.get(variable)
    try:
        return Path(base or Path.home() / usual) / name
    except RuntimeError:  # a user without a home
        return None


def _usable(folder: Path, how: int) -> bool:
    """Return True if the folder exists or can be made, and allows the access `how`."""
    try:
        make_private(folder)
        refuse_others(folder)
        _mark(folder)
        return os.access(folder, how | os.X_OK)
    except OSError:
        return False


def make_private(folder: Path) -> None:
    """Make a folder and its missing parents, with access for this user alone."""
    if not folder.is_dir():
        if folder.parent != folder:
            make_private(folder.parent)
        folder.mkdir(mode=0o700, exist_ok=True)


def refuse_others(folder: Path) -> None:
    """Raise `BadInput` if another user owns a folder of the cache or can write into it."""
    if why := whose(status := folder.stat()):
        others = status.st_mode & _OTHERS_WRITE
        raise BadInput(
            f"the cache folder {folder} is not used, because {why}, and what lies there is run as "
            f"code: {f'say chmod go-w {folder}, or ' if others else ''}name a folder of your own "
            "in DISCMECH_CACHE."
        )


def _mark(folder: Path) -> None:
    """Mark an empty folder as ours; raise `BadInput` for another without our mark."""
    if _is_marked(folder):
        return
    if all(name.startswith(DRAFT) for name in os.listdir(folder)):  # as another process marks it
        write_atomically(folder / TAG, _MARK)
    elif not _is_marked(folder):  # nor has another process marked it meanwhile
        raise BadInput(
            f"the cache folder {folder} is not used, because it has files and not our mark "
            f"({TAG}): they may be somebody else's. Move it away, or name another folder in "
            "DISCMECH_CACHE."
        )


def _is_marked(folder: Path) -> bool:
    try:
        return (folder / TAG).read_bytes().startswith(_OURS)
    except FileNotFoundError:
        return False


def of_others(path: Path) -> bool:
    """Return True if another user put a file or folder there, or can write into it."""
    return bool(whose(path.stat()))


def whose(status: os.stat_result) -> str:
    """Return why a file or folder is not the user's alone, or "" if it is."""
    if not hasattr(os, "geteuid"):  # permissions are not given as bits here
        return ""
    if status.st_mode & _OTHERS_WRITE:
        return "others can write into it"
    own = status.st_uid in (0, os.geteuid())
    return "" if own else f"it belongs to another user ({status.st_uid})"


@cache
def _temporary_folder() -> Path:
    """Return a folder for this process and those it starts; it is removed when this one ends."""
    path = os.environ.get(_TEMPORARY)
    if path and Path(path).is_dir():
        with suppress(BadInput):
            refuse_others(Path(path))
            return Path(path)
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
