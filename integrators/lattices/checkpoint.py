"""A run on disk: its rows as they are made, and the state from which it continues after a kill.

A state is written before there are rows. It counts the complete rows: later ones belong to a step
that was cut off, and are made again. So a run can be killed at any moment and continue from its
files. State and rows are sealed; changed ones are refused.
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

SECONDS = 1.0  # time between two saved states: a kill loses no more work than this


class Checkpoint:
    """The state of a run in a numpy file (npz), and its rows beside it, FILE.x.npy and so on.

    key: identifies the run. `state` is None if the run begins. Raises `BadInput` if the file
    belongs to another run or is no checkpoint.
    """

    def __init__(self, path: str | Path, key: str, name: str) -> None:
        if not isinstance(path, (str, os.PathLike)):
            raise BadInput(f"{name}: checkpoint is {shown(path)}; give the name of a file.")
        try:
            self.path, self.key, self.name = Path(path), key, name
            is_folder, is_there = self.path.parent.is_dir(), self.path.exists()
        # a zero byte in the name, bytes, a name that is too long
        except (ValueError, TypeError, OSError) as error:
            raise BadInput(
                f"{name}: checkpoint {shown(path)} is no name of a file ({error})."
            ) from None
        self._saved = time.monotonic()
        if not is_folder:
            raise BadInput(f"{name}: there is no folder {self.path.parent} for the checkpoint.")
        #: chained digest of the complete rows, and their number
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
        except Exception:  # numpy, zipfile and zlib raise many errors for a wrong file
            raise BadInput(
                f"{self.name}: {self.path} is no checkpoint, or a damaged one; delete it and its "
                "rows, or name another file."
            ) from None
        if key != self.key:
            raise BadInput(
                f"{self.name}: {self.path} is the checkpoint of another run; delete it and its "
                "rows, or name another file."
            )
        return state or None  # empty for a run that was killed before its first row

    def rows(self, shapes: Mapping[str, tuple[int, ...]]) -> list[np.ndarray]:
        """Return the columns of rows on disk, with the given shapes by name.

        Raises `BadInput` if saved rows are missing or damaged, or if another file would be
        overwritten.
        """
        paths = {word: self.path.with_name(f"{self.path.name}.{word}.npy") for word in shapes}
        if self._is_new:
            for path in paths.values():
                if path.exists():
                    raise BadInput(
                        f"{self.name}: the rows would overwrite {path}, which does not belong "
                        "to this run; delete it, or name another checkpoint."
                    )
            self._sweep()
            self._write({})  # from here on these rows belong to this run
        try:
            if self.state is None:
                return [_create(path, shapes[word]) for word, path in paths.items()]
            found = [_open(path, shapes[word]) for word, path in paths.items()]
        except OSError as error:
            raise self._write_failure(error) from None
        seal = b""
        for k in range(self._whole if all(column is not None for column in found) else 0):
            seal = _chained(seal, [column[k] for column in found])
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
        self, state: Mapping[str, np.ndarray], rows: Sequence[Any], whole: int, at_once: bool
    ) -> None:
        """Write the rows to disk, then the state; whole: the number of complete rows.

        Nothing is written within SECONDS of the last save, unless `at_once` is True. Raises
        `CouldNotRun` if the disk cannot be written.
        """
        if not at_once and time.monotonic() - self._saved < SECONDS:
            return
        try:
            for column in rows:
                column.flush()
        except OSError as error:
            raise self._write_failure(error) from None
        for k in range(self._whole, whole):
            self._seal = _chained(self._seal, [column[k] for column in rows])
        self._whole = whole
        self._write(state)
        self._saved = time.monotonic()

    def _write(self, state: Mapping[str, np.ndarray]) -> None:
        held = {word: np.asarray(array) for word, array in state.items()}
        held |= {"rows": np.array([*self._seal], np.uint8), "whole": np.array(self._whole)}
        seal = np.array([*_digest(self.key, held)], np.uint8)
        file = io.BytesIO()
        whole: dict[str, Any] = {"key": np.array(self.key), "seal": seal, **held}
        np.savez(file, **whole)
        try:
            write_atomically(self.path, file.getvalue())
        except OSError as error:
            raise self._write_failure(error) from None

    def _write_failure(self, error: OSError) -> CouldNotRun:
        why = error.strerror or error
        return CouldNotRun(
            f"{self.name}: the checkpoint {self.path} cannot be written ({why}); make room, or "
            "name another file. What was saved before is whole, and the run goes on from there."
        )

    def _sweep(self) -> None:
        """Remove drafts that a killed process left beside the file."""
        for draft in self.path.parent.glob(f"{_literal(self.path.name[:40])}*.new"):
            with suppress(OSError):
                draft.unlink()


def _digest(key: str, state: Mapping[str, np.ndarray]) -> bytes:
    whole = hashlib.sha256(key.encode())
    for word, array in sorted(state.items()):
        whole.update(f"{word} {array.dtype.str} {array.shape}".encode())
        whole.update(np.ascontiguousarray(array).tobytes())
    return whole.digest()


def _chained(seal: bytes, row: Sequence[np.ndarray]) -> bytes:
    """Return the digest of the earlier rows, with one more row."""
    whole = hashlib.sha256(seal)
    for values in row:
        whole.update(np.ascontiguousarray(values).tobytes())
    return whole.digest()


def _literal(name: str) -> str:
    return "".join(f"[{letter}]" if letter in "*?[" else letter for letter in name)


def _create(path: Path, shape: tuple[int, ...]) -> Any:
    """Return an array in a new file with reserved disk space: a missing page ends the process."""
    made: Any = np.lib.format.open_memmap(path, "w+", np.float64, shape)
    if hasattr(os, "posix_fallocate"):
        with path.open("r+b") as file:
            os.posix_fallocate(file.fileno(), 0, path.stat().st_size)
    return made


def _open(path: Path, shape: tuple[int, ...]) -> Any:
    """Return the array of doubles with that shape in a file, or None if the file differs.

    The file is opened for reading first: opened for writing, numpy would append the missing part.
    """
    try:
        found: Any = np.lib.format.open_memmap(path, "r")
        whole = path.stat().st_size == found.offset + found.nbytes
        if not (whole and found.shape == shape and found.dtype == np.float64):
            return None
        return np.lib.format.open_memmap(path, "r+")
    except Exception:  # numpy and ast raise many errors for a wrong file
        return None
