"""A run on disk: its rows as they are made, and the state from which it continues after a kill.

A state is written before there are rows. It counts the complete rows: later ones belong to a step
that was cut off, and are made again. So a run can be killed at any moment and continue from its
files. State and rows are sealed; changed ones are refused.

Numbers beyond double precision are written as decimal texts, with as many digits as tell them apart
(a column is then an array of bytes on disk, and of numbers in memory).
"""

from __future__ import annotations

import hashlib
import io
import math
import os
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BadInput, CouldNotRun, shown
from ..files import sweep, write_atomically
from ..numbers import Arithmetic
from ..numbers.types import DType
from .trajectory import Columns, allocated

SECONDS = 1.0  # time between two saved states: a kill loses no more work than this


class Checkpoint:
    """The state of a run in a numpy file (npz), and its rows beside it, FILE.x.npy and so on.

    key: identifies the run. `state` is None if the run begins, `whole` the number of complete rows.
    Raises `BadInput` if the file belongs to another run or is no checkpoint.
    """

    def __init__(self, path: str | Path, key: str, name: str, numbers: Arithmetic) -> None:
        if not isinstance(path, (str, os.PathLike)):
            raise BadInput(f"{name}: checkpoint is {shown(path)}; give the name of a file.")
        try:
            self.path, self.key, self.name, self.numbers = Path(path), key, name, numbers
            if "\0" in str(path):  # of which `exists` says only that it is not there
                raise ValueError("it has a zero byte")
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
        self._seal, self.whole = b"", 0
        #: the columns in memory whose rows are written as texts, and all columns on disk
        self._held, self._rows = dict[str, np.ndarray](), dict[str, np.memmap]()
        self._is_new = not is_there
        self.state = self._read() if is_there else None

    def _read(self) -> Mapping[str, np.ndarray] | None:
        try:
            with np.load(io.BytesIO(self.path.read_bytes()), allow_pickle=False) as file:
                state = dict(file)
            seal, key = bytes(state.pop("seal")), str(state.pop("key"))
            if seal != _digest(key, state):
                raise ValueError("it was changed")
            self._seal, self.whole = bytes(state.pop("rows")), int(state.pop("whole"))
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
        arrays = {word: self._read_numbers(array) for word, array in state.items()}
        return arrays or None  # empty for a run that was killed before its first row

    def columns(self, columns: Columns, count: int) -> dict[str, np.ndarray]:
        """Return the columns of `count` rows, on disk or with copies there (`stepper.Allocate`).

        Raises `BadInput` if saved rows are missing or damaged, or if another file would be
        overwritten.
        """
        kinds = {word: self._kind(kind) for word, (_, kind) in columns.items()}
        shapes = {word: (count, *shape) for word, (shape, _) in columns.items()}
        rows = self._rows = self._on_disk(shapes, kinds)
        texts = {word: columns[word] for word, kind in kinds.items() if kind.kind == "S"}
        self._held = allocated(texts, count, self.numbers)
        for word, column in self._held.items():
            column[: self.whole] = self._read_numbers(rows[word][: self.whole])
        return {**rows, **self._held}

    def _on_disk(
        self, shapes: Mapping[str, tuple[int, ...]], kinds: Mapping[str, np.dtype]
    ) -> dict[str, np.memmap]:
        paths = {word: self.path.with_name(f"{self.path.name}.{word}.npy") for word in shapes}
        sweep(self.path.parent)  # of drafts that a killed process left beside the file
        if self._is_new:
            for path in paths.values():
                if path.exists():
                    raise BadInput(
                        f"{self.name}: the rows would overwrite {path}, which does not belong "
                        "to this run; delete it, or name another checkpoint."
                    )
            self._write({})  # from here on these rows belong to this run
        begins = self.state is None
        try:
            columns = {
                word: (_create if begins else _open)(path, shapes[word], kinds[word])
                for word, path in paths.items()
            }
        except OSError as error:
            raise self._write_failure(error) from None
        if begins:
            return columns
        bad = [str(paths[word]) for word, column in columns.items() if column is None]
        seal = b""
        for k in range(0 if bad else self.whole):
            seal = _chained(seal, [column[k] for column in columns.values()])
        if seal != self._seal:
            names = ", ".join(bad or map(str, paths.values()))
            raise BadInput(
                f"{self.name}: the rows {names} of the checkpoint are gone or damaged; delete the "
                "checkpoint and all its rows, or name another one."
            )
        return columns

    def save(self, state: Mapping[str, np.ndarray], whole: int, at_once: bool) -> None:
        """Write the rows to disk, then the state; whole: the number of complete rows.

        Nothing is written within SECONDS of the last save, unless `at_once` is True. Raises
        `CouldNotRun` if the disk cannot be written.
        """
        if not at_once and time.monotonic() - self._saved < SECONDS:
            return
        made = slice(self.whole, whole)
        for word, column in self._held.items():
            self._rows[word][made] = self._written(column[made])
        try:
            for rows in self._rows.values():
                rows.flush()
        except OSError as error:
            raise self._write_failure(error) from None
        for k in range(self.whole, whole):
            self._seal = _chained(self._seal, [rows[k] for rows in self._rows.values()])
        self.whole = whole
        self._write({word: self._written(np.asarray(array)) for word, array in state.items()})
        self._saved = time.monotonic()

    def _write(self, state: Mapping[str, np.ndarray]) -> None:
        content = {word: np.asarray(array) for word, array in state.items()}
        content |= {"rows": np.array([*self._seal], np.uint8), "whole": np.array(self.whole)}
        seal = np.array([*_digest(self.key, content)], np.uint8)
        file = io.BytesIO()
        whole: dict[str, Any] = {"key": np.array(self.key), "seal": seal, **content}
        np.savez(file, **whole)
        try:
            write_atomically(self.path, file.getvalue())
        except OSError as error:
            raise self._write_failure(error) from None

    # -- numbers beyond double precision, as texts -------------------------------------------------

    @property
    def _more(self) -> int:
        """The decimals after the first digit that tell all numbers of the arithmetic apart."""
        bits: int = getattr(self.numbers, "bits", 53)
        return math.ceil(bits * math.log10(2)) + 1

    def _kind(self, kind: DType) -> np.dtype:
        """Return the type on disk of a column's numbers."""
        own = np.dtype(kind)
        # sign, point and exponent take at most as much again as a 64-bit number has digits
        return np.dtype(f"S{self._more + 28}") if own.hasobject else own

    def _written(self, array: np.ndarray) -> np.ndarray:
        """Return an array with numbers of more digits as texts; whole numbers stay whole."""
        if array.dtype != object:
            return array
        n = self._more
        texts = [str(e) if isinstance(e, int) else f"{e:.{n}e}" for e in array.ravel()]
        return np.array(texts, dtype="S").reshape(array.shape)

    def _read_numbers(self, array: np.ndarray) -> np.ndarray:
        """Return the array that `_written` made texts of."""
        if array.dtype.kind != "S":
            return array
        import gmpy2

        bits: int = getattr(self.numbers, "bits", 53)
        texts = [e.decode() for e in array.ravel()]
        whole = [e.lstrip("-").isdigit() for e in texts]
        items = np.empty(len(texts), dtype=object)
        items[:] = [int(e) if w else gmpy2.mpfr(e, bits) for e, w in zip(texts, whole, strict=True)]
        return items.reshape(array.shape)

    def _write_failure(self, error: OSError) -> CouldNotRun:
        why = error.strerror or error
        return CouldNotRun(
            f"{self.name}: the checkpoint {self.path} cannot be written ({why}); make room, or "
            "name another file. What was saved before is whole, and the run goes on from there."
        )


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


def _create(path: Path, shape: tuple[int, ...], kind: np.dtype) -> np.memmap:
    """Return an array in a new file with reserved disk space: a missing page ends the process."""
    made: Any = np.lib.format.open_memmap(path, "w+", kind, shape)
    if hasattr(os, "posix_fallocate"):
        with path.open("r+b") as file:
            os.posix_fallocate(file.fileno(), 0, path.stat().st_size)
    return made


def _open(path: Path, shape: tuple[int, ...], kind: np.dtype) -> Any:
    """Return the array of that shape and type in a file, or None if the file differs.

    The file is opened for reading first: opened for writing, numpy would append the missing part.
    """
    try:
        array: Any = np.lib.format.open_memmap(path, "r")
        whole = path.stat().st_size == array.offset + array.nbytes
        if not (whole and array.shape == shape and array.dtype == kind):
            return None
        return np.lib.format.open_memmap(path, "r+")
    except Exception:  # numpy and ast raise many errors for a wrong file
        return None
