"""A run on disk: its rows as they are made, and the state from which it goes on after a kill.

A state is written before there are rows, and says how many of them are whole: what stands behind
these is of a step that was cut off, and is made again. So each moment at which a run may be killed
leaves files from which it goes on. State and rows are sealed; what was changed is refused.
"""

from __future__ import annotations

import hashlib
import io
import os
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..compiler import write_atomically
from ..errors import BadInput, CouldNotRun, shown

SECONDS = 1.0  # between two states; less than that is lost by a kill


class Checkpoint:
    """The state of a run in a file of numpy's (npz), and its rows beside it, FILE.x.npy and so on.

    key: what tells this run from others. `state` is None if the run begins. Raises `BadInput` if
    the file is of another run, or none.
    """

    def __init__(self, path: Any, key: str, name: str) -> None:
        if not isinstance(path, (str, os.PathLike)):
            raise BadInput(f"{name}: checkpoint is {shown(path)}; give the name of a file.")
        try:
            self.path, self.key, self.name = Path(path), key, name
            is_folder, is_there = self.path.parent.is_dir(), self.path.exists()
        except (ValueError, TypeError, OSError) as error:  # a zero byte in it, bytes, too long
            raise BadInput(
                f"{name}: checkpoint {shown(path)} is no name of a file ({error})."
            ) from None
        self._saved = time.monotonic()
        if not is_folder:
            raise BadInput(f"{name}: there is no folder {self.path.parent} for the checkpoint.")
        #: digest of the rows that are whole, in turn, and how many these are
        self._seal, self._whole = b"", 0
        self._is_new = not is_there
        self.state = self._read() if is_there else None

    def _read(self) -> Mapping[str, np.ndarray] | None:
        try:
            with np.load(io.BytesIO(self.path.read_bytes()), allow_pickle=False) as file:
                state = dict(file)
            seal, key = bytes(state.pop("seal")), str(state.pop("key"))
            if seal != _digest(key, state):
                raise ValueError("it was changed")
            self._seal, self._whole = bytes(state.pop("rows")), int(state.pop("whole"))
        except OSError as error:
            raise BadInput(f"{self.name}: {self.path} cannot be read ({error.strerror}).") from None
        except Exception:  # numpy, zipfile and zlib say in many ways that it is no such file
            raise BadInput(
                f"{self.name}: {self.path} is no checkpoint, or a damaged one; delete it and its "
                "rows, or name another file."
            ) from None
        if key != self.key:
            raise BadInput(
                f"{self.name}: {self.path} is the checkpoint of another run; delete it and its "
                "rows, or name another file."
            )
        return state or None  # nothing of a run that was killed before its first row

    def rows(self, shapes: Mapping[str, tuple[int, ...]]) -> list[np.ndarray]:
        """The columns of rows on disk, of those shapes by name.

        Raises `BadInput` if those of a state are gone or damaged, and where a file that is no row
        of this run would be overwritten.
        """
        paths = {word: self.path.with_name(f"{self.path.name}.{word}.npy") for word in shapes}
        if self._is_new:
            for path in paths.values():
                if path.exists():
                    raise BadInput(
                        f"{self.name}: the rows would overwrite {path}, which is none of this "
                        "run's; delete it, or name another checkpoint."
                    )
            self._sweep()
            self._write({})  # from here on these rows are this run's
        try:
            if self.state is None:
                return [_made(path, shapes[word]) for word, path in paths.items()]
            found = [_opened(path, shapes[word]) for word, path in paths.items()]
        except OSError as error:
            raise self._refused(error) from None
        seal = b""
        for k in range(self._whole if all(column is not None for column in found) else 0):
            seal = _next(seal, [column[k] for column in found])
        if seal != self._seal:
            names = ", ".join(map(str, paths.values()))
            bad = [
                str(p) for p, column in zip(paths.values(), found, strict=True) if column is None
            ]
            raise BadInput(
                f"{self.name}: the rows {', '.join(bad) or names} of the checkpoint are gone or "
                "damaged; delete the checkpoint and all its rows, or name another one."
            )
        return found

    def save(
        self, state: Mapping[str, Any], rows: Sequence[Any], whole: int, at_once: bool
    ) -> None:
        """Rows to disk, then the state, if it is time to, or at once; whole: the rows made so far.

        Raises `CouldNotRun` where the disk takes nothing.
        """
        if not at_once and time.monotonic() - self._saved < SECONDS:
            return
        try:
            for column in rows:
                column.flush()
        except OSError as error:
            raise self._refused(error) from None
        for k in range(self._whole, whole):
            self._seal = _next(self._seal, [column[k] for column in rows])
        self._whole = whole
        self._write(state)
        self._saved = time.monotonic()

    def _write(self, state: Mapping[str, Any]) -> None:
        held = {word: np.asarray(array) for word, array in state.items()}
        held |= {"rows": np.array([*self._seal], np.uint8), "whole": np.array(self._whole)}
        seal = np.array([*_digest(self.key, held)], np.uint8)
        file = io.BytesIO()
        whole: dict[str, Any] = {"key": np.array(self.key), "seal": seal, **held}
        np.savez(file, **whole)
        try:
            write_atomically(self.path, file.getvalue())
        except OSError as error:
            raise self._refused(error) from None

    def _refused(self, error: OSError) -> CouldNotRun:
        why = error.strerror or error
        return CouldNotRun(
            f"{self.name}: the checkpoint {self.path} cannot be written ({why}); make room, or "
            "name another file. What was saved before is whole, and the run goes on from there."
        )

    def _sweep(self) -> None:
        """Remove what a process that was killed had begun to write beside the file."""
        for draft in self.path.parent.glob(f"{_literal(self.path.name[:40])}*.new"):
            with suppress(OSError):
                draft.unlink()


def _digest(key: str, state: Mapping[str, np.ndarray]) -> bytes:
    whole = hashlib.sha256(key.encode())
    for word, array in sorted(state.items()):
        whole.update(f"{word} {array.dtype.str} {array.shape}".encode())
        whole.update(np.ascontiguousarray(array).tobytes())
    return whole.digest()


def _next(seal: bytes, row: Sequence[np.ndarray]) -> bytes:
    """The digest of some rows and of one more."""
    whole = hashlib.sha256(seal)
    for values in row:
        whole.update(np.ascontiguousarray(values).tobytes())
    return whole.digest()


def _literal(name: str) -> str:
    return "".join(f"[{letter}]" if letter in "*?[" else letter for letter in name)


def _made(path: Path, shape: tuple[int, ...]) -> Any:
    """An array in a new file, whose room on the disk is there: a page without ends the process."""
    made: Any = np.lib.format.open_memmap(path, "w+", np.float64, shape)
    if hasattr(os, "posix_fallocate"):
        with path.open("r+b") as file:
            os.posix_fallocate(file.fileno(), 0, path.stat().st_size)
    return made


def _opened(path: Path, shape: tuple[int, ...]) -> Any:
    """The array of just so many doubles in a file; None if that is not what it holds.

    It is looked at for reading first: for writing too, numpy would fill up what is missing.
    """
    try:
        found: Any = np.lib.format.open_memmap(path, "r")
        whole = path.stat().st_size == found.offset + found.nbytes
        if not (whole and found.shape == shape and found.dtype == np.float64):
            return None
        return np.lib.format.open_memmap(path, "r+")
    except Exception:  # numpy and ast say in many ways that it is none
        return None
