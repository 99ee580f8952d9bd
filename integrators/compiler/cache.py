"""A private folder of the user's for what is generated: nothing is derived or compiled twice."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType


def cache_folder() -> Path:
    """DISCMECH_CACHE, or discmech in the user's cache folder; made private when made."""
    chosen = os.environ.get("DISCMECH_CACHE")
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    folder = Path(chosen) if chosen else Path(base) / "discmech"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if os.access(folder, os.W_OK):
            return folder
    except OSError:
        pass
    return _temporary_folder()


@cache
def _temporary_folder() -> Path:
    return Path(tempfile.mkdtemp(prefix="discmech-"))


#: folders whose text is in the equations that it makes, and so in each name by itself
IN_EQUATIONS = ("scenes", "rules")
#: but not these: Gauss and Lobatto nodes are numbers in machine code, of which no text says more
#: than how many there are
IN_TABLES = ("quadrature.py",)


@cache
def sources() -> str:
    """Digest of all of our own text that generates: changed mathematics makes new files."""
    files = sorted(Path(__file__).parents[1].rglob("*.py"))
    return digest(*(p.read_bytes() for p in files
                    if p.parent.name not in IN_EQUATIONS or p.name in IN_TABLES))  # fmt: skip


def digest(*parts: str | bytes) -> str:
    """A name that no other text has."""
    whole = b"\0".join(part.encode() if isinstance(part, str) else part for part in parts)
    return hashlib.sha256(whole).hexdigest()[:24]


def write_atomically(path: Path, content: str | bytes) -> None:
    """Write to another name, then rename: nobody ever sees half a file, even after a crash."""
    handle, draft = tempfile.mkstemp(dir=path.parent, prefix=path.name[:40], suffix=".new")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content.encode() if isinstance(content, str) else content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(draft, path)
    except BaseException:
        Path(draft).unlink(missing_ok=True)
        raise


def cached_text(name: str, build: Callable[[], str]) -> str:
    """The text of a file in the cache, built if it is not there."""
    path = cache_folder() / name
    if not path.exists():
        write_atomically(path, build())
    return path.read_text(encoding="utf-8")


@cache
def imported(path: Path) -> ModuleType:
    """The module of a generated file, known by name: so numba keeps its machine code."""
    spec = importlib.util.spec_from_file_location(f"discmech_{path.stem}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module
