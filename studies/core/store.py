"""One sqlite file of measurements: found again by key, judged anew, compared, remembered.

A row has a kind, a name that is unique in its kind, and JSON with the digest of all three.
"measurement", "cause", "smallest", "answer" and "figure" are named by all that they depend on
(`fingerprint`), and made again if they are missing; a "run" is named by its time. Every row is
checked before use, and a file that cannot be written to costs no more than the time of measuring
again.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sqlite3
import time
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from discmech.integrators.places import (
    cache_folder,
    cache_folders,
    make_private,
    of_others,
    refuse_others,
)

VERSION = 1  # version of the table: each has a file of its own, beside the others
MOST = 20_000  # rows that can be made again; beyond this, the longest unused half is removed
LASTING = ("run",)  # kinds that cannot be made again
PATIENCE = 60.0  # seconds to wait for another process that writes
#: files whose lock this process has waited for in vain: nobody waits again until it is free
_HELD: set[Path] = set()
DAY = 86400.0
_TABLE = """CREATE TABLE entry (
    kind TEXT, name TEXT, used REAL, seal TEXT, content TEXT, PRIMARY KEY (kind, name))"""
_WRITE = "INSERT OR REPLACE INTO entry (kind, name, used, seal, content) VALUES (?, ?, ?, ?, ?)"
#: what a file may raise; Python cannot decode an error that quotes a damaged text
_TROUBLES = (sqlite3.Error, OSError, UnicodeDecodeError)
#: errors of a file that is not, or not any more, a store
_RUINED = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_FORMAT)
#: likewise of reading: it ends too early, its place on the disk is none, its checksum is wrong
_RUINED_DISK = (sqlite3.SQLITE_IOERR_SHORT_READ, sqlite3.SQLITE_IOERR_CORRUPTFS,
                sqlite3.SQLITE_IOERR_DATA)  # fmt: skip
BESIDE = ("-wal", "-shm", "-journal")  # what sqlite keeps beside a file, and believes


class Damaged(Exception):
    """A row that differs from the one that was written."""


class _Ruined(sqlite3.DatabaseError):
    """A file whose table is not the one that was made."""


class _Open(NamedTuple):
    """A connection of this process to the file that had this number (inode) when it was opened."""

    file: sqlite3.Connection
    inode: int
    process: int


class Store:
    """The rows of the user's cache folder, and of a read-only one, if there is one.

    fresh: True to find no rows that can be made again, so that all is measured anew (and then
    kept). troubles: a sentence for each kind of trouble.
    """

    def __init__(self, fresh: bool = False) -> None:
        self._open: dict[Path, _Open] = {}
        self.path, self.fresh = _file_of(cache_folder()), fresh
        self._others = [_file_of(folder) for folder in cache_folders()[1:]]
        self.troubles: dict[str, str] = {}
        self._used: list[tuple[float, str, str]] = []

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for another process, which opens the files itself."""
        return {**vars(self), "_open": {}, "_used": []}

    def __del__(self) -> None:
        """Close the files: since Python 3.13 a connection that nobody closes is warned of."""
        self.close()

    def find(self, kind: str, name: str) -> Any | None:
        """Return the content of a row that can be made again, or None; a damaged one is removed."""
        asked = "SELECT used, seal, content FROM entry WHERE kind = ? AND name = ?"
        for path in () if self.fresh else (self.path, *self._others):
            for used, seal, content in self._rows(path, asked, (kind, name)):
                if time.time() - used > DAY and path == self.path:
                    self._used.append((time.time(), kind, name))
                try:
                    return _checked(kind, name, seal, content)
                except Damaged:
                    self.troubles["damaged"] = (
                        f"a stored result was damaged ({path}); it was measured again."
                    )
                    self.remove(kind, [name])  # a new measurement takes its place, if possible
                    return None
        return None

    def keep(self, kind: str, name: str, content: Any) -> Any:
        """Write a row, if possible; return the content as it will be found."""
        text = json.dumps(content)
        with suppress(OSError):
            self._kept(kind, name, text)
        return json.loads(text)

    def save(self, kind: str, name: str, content: Any) -> None:
        """Write a row, to the disk itself; raises `OSError` if the disk does not take it."""
        with suppress(*_TROUBLES):  # the write then reports it
            self._opened(self.path).execute("PRAGMA synchronous = FULL")
        self._kept(kind, name, json.dumps(content))
        self.close()

    def remembered(self, kind: str, name: str, make: Callable[[], Any]) -> Any:
        """Return the content of a row, or make it now and keep it."""
        earlier = self.find(kind, name)
        return self.keep(kind, name, make()) if earlier is None else earlier

    def all(self, kind: str) -> Iterator[tuple[str, Any | None, int]]:
        """Yield (name, content, size) of all rows of a kind, the last name first; None: damaged."""
        asked = "SELECT name, seal, content FROM entry WHERE kind = ? ORDER BY name DESC"
        for name, seal, content in self._rows(self.path, asked, (kind,)):
            try:
                yield name, _checked(kind, name, seal, content), len(str(content))
            except Damaged:
                yield name, None, 0

    def remove(self, kind: str, names: list[str]) -> None:
        """Remove rows, if possible."""
        with suppress(*_TROUBLES):
            for name in names:
                self._write("DELETE FROM entry WHERE kind = ? AND name = ?", (kind, name))

    def prune(self) -> None:
        """Note the rows that were used, remove the longest unused beyond the limit, close."""
        lasting = ", ".join(f"'{kind}'" for kind in LASTING)
        count = self._rows(self.path, f"SELECT count(*) FROM entry WHERE kind NOT IN ({lasting})")
        with suppress(*_TROUBLES):  # a read-only folder
            if self._used:
                self._write("UPDATE entry SET used = ? WHERE kind = ? AND name = ?", *self._used)
            if any(number > MOST for (number,) in count):
                self._write(
                    f"DELETE FROM entry WHERE rowid IN (SELECT rowid FROM entry WHERE kind NOT IN "
                    f"({lasting}) ORDER BY used DESC LIMIT -1 OFFSET {MOST // 2})"
                )
        self._used = []
        self.close()

    def close(self) -> None:
        """Close the files until the next use: all rows are in the one file then."""
        for opened in self._open.values():
            if opened.process == os.getpid():
                opened.file.close()
        self._open = {}

    def _kept(self, kind: str, name: str, text: str) -> None:
        try:
            self._write(_WRITE, (kind, name, time.time(), _seal(kind, name, text), text))
        except _TROUBLES as error:
            self.troubles["keep"] = (
                f"results cannot be kept for the next run ({_told(error)}: {self.path})."
            )
            raise OSError(_told(error)) from None

    # -- the file -------------------------------------------------------------------------

    def _rows(self, path: Path, asked: str, values: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
        """Return the rows that a query finds in a file; [] without a readable file."""
        if not path.exists():
            return []
        for again in (True, False):
            try:
                return self._opened(path).execute(asked, values).fetchall()
            except _TROUBLES as error:
                if again and path == self.path and _is_ruined(error, path):
                    with suppress(OSError):
                        self._put_aside(path, "damaged")
                # a full disk takes no table, so there are no rows
                elif _code(error) != sqlite3.SQLITE_FULL:
                    why = _told(error, path)
                    self.troubles["read"] = f"stored results cannot be read ({why}: {path})."
        return []

    def _write(self, statement: str, *rows: tuple[Any, ...]) -> None:
        """Change the file, as a whole or not at all; use a new file if this one is ruined."""
        for again in (True, False):
            try:
                file = self._opened(self.path)
                with file:  # one transaction
                    file.executemany(statement, rows or [()])
                _HELD.discard(self.path)
                return
            except _TROUBLES as error:
                if not (again and _is_ruined(error, self.path)):
                    _told(error, self.path)
                    raise
                self._put_aside(self.path, "damaged")

    def _opened(self, path: Path) -> sqlite3.Connection:
        """Return the file, of our version, that has this name now; it waits for others' locks."""
        known = self._open.get(path)
        with suppress(OSError):
            if known and known.process == os.getpid() and known.inode == path.stat().st_ino:
                known.file.execute(_patience(path))
                return known.file
        is_own = path == self.path
        if is_own:
            make_private(path.parent)
            refuse_others(path.parent)
            _made(path)
        if strange := _of_others(path):
            if not is_own:
                raise PermissionError(f"{strange} is not yours alone")
            self._put_aside(path, "of-others")
            return self._opened(path)
        inode, how = path.stat().st_ino, "mode=rw" if is_own else "immutable=1"
        where = f"{path.absolute().as_uri()}?{how}"
        file = sqlite3.connect(where, uri=True, check_same_thread=False)
        file.text_factory = _text
        file.execute(_patience(path))
        self._open[path] = _Open(file, inode, os.getpid())
        (version,) = file.execute("PRAGMA user_version").fetchone()
        file.execute("PRAGMA synchronous = NORMAL")
        if version == 0 and is_own:
            try:
                self._begin(file)
            except _TROUBLES:  # as of a full disk: next time it is begun again
                self._open.pop(path).file.close()
                raise
        elif version != VERSION and is_own:
            self._put_aside(path, f"version-{version}")
            return self._opened(path)
        elif is_own and file.execute("SELECT sql FROM sqlite_master").fetchone() != (_TABLE,):
            raise _Ruined(f"it has no table of ours ({path})")
        return file

    def _begin(self, file: sqlite3.Connection) -> None:
        """Make the table in an empty file."""
        file.execute("PRAGMA busy_timeout = 0")
        with suppress(sqlite3.OperationalError):  # another process is doing it
            file.execute("PRAGMA journal_mode = WAL")  # a write waits for no disk or reader
        file.execute(_patience(self.path))
        with file:
            file.execute("BEGIN IMMEDIATE")
            file.execute(_TABLE.replace("TABLE", "TABLE IF NOT EXISTS"))
            file.execute(f"PRAGMA user_version = {VERSION}")

    def _put_aside(self, path: Path, why: str) -> None:
        """Rename a file that is not to be used; copy the whole rows of a damaged one."""
        known = self._open.pop(path, None)
        if known is not None:
            known.file.close()
        with suppress(OSError):
            if known is not None and known.inode != path.stat().st_ino:
                return  # another process has done it
        number = 1
        while (aside := path.with_name(f"{path.stem}-{why}-{number}{path.suffix}")).exists():
            number += 1
        path.rename(aside)
        for end in BESIDE:  # with the rows that were written last
            with suppress(OSError):
                path.with_name(path.name + end).rename(aside.with_name(aside.name + end))
        told = f"the store of results was {_WHY[why.split('-')[0]]}: it is {aside} now"
        self.troubles["aside"] = f"{told}."
        if why == "damaged":
            try:
                if rows := rows_in(aside):
                    self._write(_WRITE, *rows)
                kept = (
                    f"{len(rows) or 'none'} of its results are whole{', and kept' if rows else ''}"
                )
            except _TROUBLES as error:
                kept = f"its results cannot be kept ({_told(error)})"
            self.troubles["aside"] = f"{told}; {kept}."


class Carried:
    """The measurements of a worker on another machine, to be kept by the machine that asked."""

    def __init__(self) -> None:
        self.rows: list[tuple[str, Any]] = []

    def find(self, kind: str, name: str) -> None:
        """Find nothing: rows are found on the machine that asked."""

    def keep(self, kind: str, name: str, content: Any) -> Any:
        """Carry the content; return it as it will be found."""
        self.rows.append((kind, again := json.loads(json.dumps(content))))
        return again

    def remembered(self, kind: str, name: str, make: Callable[[], Any]) -> Any:
        """Make the content now."""
        return make()

    def taken(self) -> Any | None:
        """Return the latest measurement, once; None if there is none."""
        contents = [content for kind, content in self.rows if kind == "measurement"]
        self.rows = []
        return contents[-1] if contents else None


_WHY = {
    "damaged": "damaged",
    "of": "not yours alone",
    "version": "of another version of discmech",
}


def _made(path: Path) -> None:
    """Make an empty file that is the user's alone, if there is none; never open another one.

    A process that closes a file by itself loses all locks that sqlite holds on it there, so another
    process removes a journal which this one's other stores still read.
    """
    with suppress(FileExistsError):
        os.close(os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o600))


def _of_others(path: Path) -> Path | None:
    """Return what sqlite would believe, of a file and what is beside it, that is not ours alone."""
    for part in (path.parent, path, *(path.with_name(path.name + end) for end in BESIDE)):
        with suppress(FileNotFoundError):
            if of_others(part):
                return part
    return None


def _patience(path: Path) -> str:
    return f"PRAGMA busy_timeout = {0 if path in _HELD else int(1000 * PATIENCE)}"


def _text(content: bytes) -> str:
    """Return a text of the file; the seal tells of one that is damaged."""
    return content.decode(errors="replace")


def rows_in(path: Path) -> list[tuple[Any, ...]]:
    """Return the whole rows of a store; none of one that others could have written.

    A copy is read, from both of its ends: the file stays as it is. Raises `OSError` without room.
    """
    rows: dict[tuple[str, str], tuple[Any, ...]] = {}
    if _of_others(path):
        return []
    with TemporaryDirectory() as folder:
        copy = Path(folder) / "copy"
        for end in ("", "-wal", "-journal"):
            with suppress(FileNotFoundError):
                shutil.copyfile(path.with_name(path.name + end), f"{copy}{end}")
        for order in ("ASC", "DESC"):
            asked = f"SELECT kind, name, used, seal, content FROM entry ORDER BY rowid {order}"
            with suppress(*_TROUBLES), closing(sqlite3.connect(copy)) as file:
                file.text_factory = _text
                for kind, name, used, seal, content in file.execute(asked):
                    with suppress(Damaged):
                        _checked(kind, name, seal, content)
                        rows[kind, name] = kind, name, used, seal, content
    return list(rows.values())


def _file_of(folder: Path) -> Path:
    version = "" if VERSION == 1 else f"-{VERSION}"
    return folder / "results" / f"store{version}.sqlite"


def _seal(kind: str, name: str, text: str) -> str:
    return hashlib.sha256("\0".join((kind, name, text)).encode()).hexdigest()


def _checked(kind: Any, name: Any, seal: Any, content: Any) -> Any:
    """Return the content of a row; raises `Damaged` if it differs from the one that was written."""
    try:
        if seal == _seal(kind, name, content):
            return json.loads(content)
    except (TypeError, ValueError, AttributeError):
        pass
    raise Damaged


def _code(error: BaseException) -> int:
    return int(getattr(error, "sqlite_errorcode", 0))


def _told(error: Exception, path: Path | None = None) -> str:
    """Return an error's words; the lock of a file that was waited for is not waited for again."""
    if _code(error) & 0xFF in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
        if path is not None:
            _HELD.add(path)
        return "another program holds its lock"
    return getattr(error, "strerror", None) or str(error)


def _is_ruined(error: BaseException, path: Path) -> bool:
    """Return True if the error is the file's: not of a lock, a full disk, or of rights."""
    code = _code(error)
    if code == sqlite3.SQLITE_READONLY:  # a number in its head may say that, or the disk
        return os.access(path, os.W_OK) and os.access(path.parent, os.W_OK)
    return (
        isinstance(error, _Ruined | UnicodeDecodeError)
        or (code & 0xFF in _RUINED or code in _RUINED_DISK)
        or "unsupported file format" in str(error)
    )
