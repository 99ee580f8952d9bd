"""The cache of kernels: nothing is derived or compiled twice.

The files there are run as code. So one is trusted only if nobody else can have written it and if it
still has the content that was written: every file begins with the digest of its name and content.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import cache
from pathlib import Path

from ..files import asked_for, encoded, prune, write_atomically
from ..places import cache_folder, cache_folders, make_private, say_once, whose

_SEAL = b"discmech "

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
    content = encoded(content) if isinstance(content, str) else content
    write_atomically(path, _seal(path.name, content) + content)


def unsealed(path: Path) -> bytes | None:
    """Return the content that `seal` wrote, or None if the file is missing or unreadable.

    Raises `Damaged` if the digest is wrong, or if another user owns the file or can write to it.
    """
    try:
        with path.open("rb") as file:
            others, data = whose(os.fstat(file.fileno())), file.read()
    except OSError:
        return None
    head, newline, content = data.partition(b"\n")
    if others or head + newline != _seal(path.name, content):
        raise Damaged(path)
    return content


class Damaged(Exception):
    """A cached file whose content is not what was written; its argument is the path."""


def _seal(name: str, content: bytes) -> bytes:
    whole = hashlib.sha256(name.encode() + b"\0" + content)
    return _SEAL + whole.hexdigest().encode() + b"\n"


def cached(name: str, build: Callable[[], bytes]) -> bytes:
    """Return the content of a cached file; build it if it is missing or damaged.

    If the disk cannot store it, it is built again the next time.
    """
    content = find(name)
    if content is None:
        content = build()
        keep(name, content)
    return content


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
            asked_for(path)
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
    prune(folder, _is_sealed)


def _is_sealed(path: Path) -> bool:
    """Return True if `seal` wrote the file, as it is."""
    try:
        return unsealed(path) is not None
    except Damaged:
        return False
