"""Write beside, then rename: a folder of results is the old one or the new one, never half."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def published(folder: Path, last: str) -> Iterator[Path]:
    """A fresh folder to write into; when the block ends well, its entries move to `folder`.

    The entry named `last` moves last, because it refers to the others. Other things that stand
    in `folder` stay. When anything fails the old entries are as they were.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    stage = Path(tempfile.mkdtemp(prefix=".part-", dir=folder))
    new, old = stage / "new", stage / "old"
    new.mkdir()
    old.mkdir()
    try:
        yield new
        names = sorted((entry.name for entry in new.iterdir()), key=lambda name: name == last)
        _swap(folder, new, old, names)
    finally:
        shutil.rmtree(stage, ignore_errors=True)


def _swap(folder: Path, new: Path, old: Path, names: list[str]) -> None:
    moved: list[str] = []
    try:
        for name in names:
            target = folder / name
            moved.append(name)
            if target.is_dir():
                os.replace(target, old / name)
            elif target.exists():
                shutil.copy2(target, old / name)
            os.replace(new / name, target)
    except BaseException:
        for name in moved:
            target = folder / name
            if (old / name).exists():
                if target.is_dir():
                    shutil.rmtree(target)
                os.replace(old / name, target)
            elif target.exists() and not (new / name).exists():
                shutil.rmtree(target) if target.is_dir() else target.unlink()
        raise
