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
        self.path, self.key = Path(path), key
        self._saved = time.monotonic()
        if not self.path.parent.is_dir():
            raise BadInput(f"{name}: there is no folder {self.path.parent} for the checkpoint.")
        self.state = self._read(name) if self.path.exists() else None

    def _read(self, name: str) -> Mapping[str, np.ndarray]:
        try:
            with np.load(io.BytesIO(self.path.read_bytes()), allow_pickle=False) as file:
                state = dict(file)
            key = str(state.pop("key"))
        except Exception:  # numpy, zipfile and zlib say in many ways that it is no such file
            raise BadInput(
                f"{name}: {self.path} is no checkpoint, or a damaged one; delete it, or name "
                "another file."
            ) from None
        if key != self.key:
            raise BadInput(
                f"{name}: {self.path} is the checkpoint of another run; delete it, or name another "
                "file."
            )
        return state

    def rows(self, word: str, shape: tuple[int, ...]) -> np.ndarray:
        """The array of a column of rows on disk; raises `BadInput` if those so far are gone."""
        path = self.path.with_name(f"{self.path.name}.{word}.npy")
        begun = self.state is not None
        if begun and not path.exists():
            raise BadInput(f"the rows {path} of the checkpoint are gone; delete the checkpoint.")
        mode: Any = "r+" if begun else "w+"
        if begun:
            return np.lib.format.open_memmap(path, mode)
        return np.lib.format.open_memmap(path, mode, np.float64, shape)

    def save(self, state: Mapping[str, Any], rows: list[Any], last: bool) -> None:
        """Rows to disk, then the state, if it is time to or the run is at its end."""
        if not last and time.monotonic() - self._saved < SECONDS:
            return
        for column in rows:
            column.flush()
        file = io.BytesIO()
        np.savez(file, key=np.array(self.key), **state)
        write_atomically(self.path, file.getvalue())
        self._saved = time.monotonic()
