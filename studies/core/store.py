"""Results that were measured before, by the fingerprint of all that they depend on.

An entry is a file: the digest of its name and of what follows, then JSON. One that does not agree
with its digest is removed and measured again. Nothing here is believed that was not checked, and a
store that cannot be written to costs no more than the time of measuring again.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from discmech.integrators.compiler import Damaged, cache_folder, cache_folders, seal, unsealed

MOST = 20_000  # entries; the longest unused go first


class Store:
    """Results by fingerprint in the user's cache folder.

    fresh: nothing is found, so that all is measured anew (and then kept). troubles: a sentence for
    each kind of thing that went wrong.
    """

    def __init__(self, fresh: bool = False) -> None:
        self.folder, self.fresh = cache_folder() / "results", fresh
        self._others = [folder / "results" for folder in cache_folders()[1:]]
        self.troubles: dict[str, str] = {}

    def find(self, key: str) -> Any | None:
        """The result of that fingerprint, or None."""
        for folder in () if self.fresh else (self.folder, *self._others):
            path = _path(folder, key)
            try:
                entry = unsealed_json(path)
            except Damaged:
                entry = {}
            if entry is None:
                continue
            if entry.get("key") != key:
                self._remove_damaged(path)
                continue
            with suppress(OSError):  # a folder that may only be read
                os.utime(path)  # the longest unused go first
            return entry["result"]
        return None

    def keep(self, key: str, result: Any) -> Any:
        """Keep a result; returns it as it will be found."""
        text = json.dumps({"key": key, "result": result})
        path = _path(self.folder, key)
        try:
            seal(path, text)
        except OSError as error:
            why = error.strerror or error
            self.troubles["keep"] = (
                f"results cannot be kept for the next run ({why}: {self.folder})."
            )
        return json.loads(text)["result"]

    def remembered(self, key: str, make: Callable[[], Any]) -> Any:
        """The result of that fingerprint, or what is made now and kept."""
        earlier = self.find(key)
        return self.keep(key, make()) if earlier is None else earlier

    def prune(self) -> None:
        """Remove the entries that were not used for longest, where there are more than `MOST`."""
        files = list(self.folder.glob("*/*"))
        if len(files) > MOST:
            for path in sorted(files, key=_age, reverse=True)[MOST // 2 :]:
                with suppress(OSError):  # a folder that may only be read
                    path.unlink(missing_ok=True)

    def _remove_damaged(self, path: Path) -> None:
        self.troubles["damaged"] = f"a stored result was damaged ({path}); it was measured again."
        with suppress(OSError):  # what is measured now takes its place, if it can
            path.unlink(missing_ok=True)


def unsealed_json(path: Path) -> dict[str, Any] | None:
    """The JSON object that was sealed there; None if there is none. Raises `Damaged`."""
    content = unsealed(path)
    if content is None:
        return None
    try:
        return dict(json.loads(content))
    except (ValueError, TypeError):
        raise Damaged(path) from None


def _path(folder: Path, key: str) -> Path:
    return folder / key[:2] / key[2:]


def _age(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:  # another process removed it
        return 0.0
