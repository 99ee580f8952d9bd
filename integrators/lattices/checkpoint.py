"""A run on disk: its rows as they are made, and the state from which it goes on after a kill."""

from __future__ import annotations

import io
import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..compiler import write_atomically
from ..errors import BadInput

SECONDS = 1.0  # between two states; less than that is lost by a kill


class Checkpoint:
    """The state of a run in a file of numpy's (npz), and its rows beside it, FILE.x.npy and so on.

    key: what tells this run from others. Raises `BadInput` if the file is of another run, or none.
    """

    def __init__(self, path: Any, key: str, name: str) -> None:
        if not isinstance(path, (str, os.PathLike)):
            raise BadInput(f"{name}: checkpoint is {path!r}; give the name of a file.")
        self.path, self.key, self.name = Path(path), key, name
        self._saved = time.monotonic()
        if not self.path.parent.is_dir():
            raise BadInput(f"{name}: there is no folder {self.path.parent} for the checkpoint.")
        self.state = self._read() if self.path.exists() else None

    def _read(self) -> Mapping[str, np.ndarray]:
        try:
            with np.load(io.BytesIO(self.path.read_bytes()), allow_pickle=False) as file:
                state = dict(file)
            key = str(state.pop("key"))
        except Exception:  # numpy, zipfile and zlib say in many ways that it is no such file
            raise BadInput(
                f"{self.name}: {self.path} is no checkpoint, or a damaged one; delete it, or name "
                "another file."
            ) from None
        if key != self.key:
            raise BadInput(
                f"{self.name}: {self.path} is the checkpoint of another run; delete it and its "
                "rows, or name another file."
            )
        return state

    def rows(self, shapes: Mapping[str, tuple[int, ...]]) -> list[np.ndarray]:
        """The columns of rows on disk, of those shapes by name.

        Raises `BadInput` if those of a state are gone or damaged, and where a file that is no row
        of this run would be overwritten.
        """
        paths = {word: self.path.with_name(f"{self.path.name}.{word}.npy") for word in shapes}
        for word, path in paths.items():
            if self.state is None and path.exists():
                raise BadInput(f"{self.name}: the rows would overwrite {path}, which is none "
                               "of this run's; delete it, or name another checkpoint.")  # fmt: skip
            if self.state is not None and not _fits(path, shapes[word]):
                raise BadInput(
                    f"{self.name}: the rows {path} of the checkpoint are gone or damaged; delete "
                    "the checkpoint and all its rows, or name another one."
                )
        mode: Any = "w+" if self.state is None else "r+"
        return [np.lib.format.open_memmap(path, mode, np.float64, shapes[word])
                for word, path in paths.items()]  # fmt: skip

    def save(self, state: Mapping[str, Any], rows: list[Any], at_once: bool) -> None:
        """Rows to disk, then the state, if it is time to, or at once."""
        if not at_once and time.monotonic() - self._saved < SECONDS:
            return
        for column in rows:
            column.flush()
        file = io.BytesIO()
        np.savez(file, key=np.array(self.key), **state)
        write_atomically(self.path, file.getvalue())
        self._saved = time.monotonic()


def _fits(path: Path, shape: tuple[int, ...]) -> bool:
    """Whether a file holds just an array of doubles of that shape.

    It is opened for reading: for writing too, numpy would fill up what is missing with zeros.
    """
    try:
        found: Any = np.lib.format.open_memmap(path, "r")
    except (ValueError, OSError):
        return False
    whole = path.stat().st_size == found.offset + found.nbytes
    return whole and found.shape == shape and found.dtype == np.float64
