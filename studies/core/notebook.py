"""The text of a rule or scene that a notebook or a script defines, so that a command can name it.

A command runs in a process of its own. Definitions in cells are written to a file in the user's
cache: the imports of all cells, and of the rest only the statements on which they depend.
"""

from __future__ import annotations

import ast
import operator
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

from discmech.integrators.compiler import digest
from discmech.integrators.files import encoded, prune, write_atomically
from discmech.integrators.places import cache_folder, make_private

from .userfile import things_in

Alike = Callable[[Any, Any], bool]


def place_of(thing: Any, function: Any, alike: Alike = operator.is_) -> str | None:
    """Return FILE.py of an object that is a variable of a script, of a module beside it or of a
    notebook's cells, or in a list of theirs.

    function: the one that makes the object, a rule's formula or a scene's Lagrangian, whose module
    is searched. alike(held, thing): True for the same object. None for other objects, and if the
    disk takes no file.
    """
    made = getattr(getattr(function, "__code__", None), "co_filename", "")
    for module in [sys.modules.get("__main__"), *sys.modules.values()]:
        held = getattr(module, "__dict__", {})
        name = held.get("__file__") or ""
        # a command loads a file by its path, so it is no part of a package
        own = module is sys.modules.get("__main__") or (
            made and name == made and not held.get("__package__")
        )
        if own and _file(name) and any(alike(e, thing) for e in things_in(held)):
            return str(name)
    space = _names_of_notebook()
    names = [name for name, value in space.items() if alike(value, thing) and name[:1] != "_"]
    text = text_of(names[0], space.get("In") or ()) if names else ""
    if not text:
        return None
    path = cache_folder() / "notebooks" / _name(encoded(text))
    try:
        if not _is_ours(path):  # damaged or missing
            make_private(path.parent)
            write_atomically(path, text)
            prune(path.parent, _is_ours)
    except OSError:  # a full disk: there is no file to name
        return None
    return str(path)


def _name(text: bytes) -> str:
    return f"{digest(text)[:16]}.py"


def _is_ours(path: Path) -> bool:
    return path.is_file() and path.name == _name(path.read_bytes())


@lru_cache(maxsize=256)
def _file(name: str) -> Path | None:
    """Return the Python file of that name, without links; None if it is none."""
    file = Path(name)
    return file.resolve() if file.suffix == ".py" and file.is_file() else None


def _names_of_notebook() -> dict[str, Any]:
    """Return the names of the running notebook, with its cells as "In"; empty without one."""
    ask = getattr(sys.modules.get("IPython"), "get_ipython", None)
    shell = ask() if ask is not None else None
    return dict(getattr(shell, "user_ns", {}))


def text_of(name: str, cells: Sequence[str]) -> str:
    """Return the program that defines a name: all imports, and the statements that it depends on.

    If several statements bind a name, the last one before its use counts. Expressions, whose values
    are not kept, are left out. It is empty if no cell binds the name.
    """
    statements = list(_statements(cells))
    bound: dict[str, list[int]] = {}
    for k, node in enumerate(statements):
        for each in _binds(node):
            bound.setdefault(each, []).append(k)
    if name not in bound:
        return ""
    needed, waiting = set[int](), [bound[name][-1]]
    while waiting:
        if (k := waiting.pop()) in needed:
            continue
        needed.add(k)
        node = statements[k]
        # its names are read when it is called
        later = isinstance(node, ast.FunctionDef | ast.ClassDef)
        read = (
            e for e in ast.walk(node) if isinstance(e, ast.Name) and isinstance(e.ctx, ast.Load)
        )
        for used in read:
            before = [at for at in bound.get(used.id, ()) if at < k or later]
            waiting += before[-1:]
    kept = [node for k, node in enumerate(statements)
            if k in needed or isinstance(node, ast.Import | ast.ImportFrom)]  # fmt: skip
    return "".join(f"{ast.unparse(node)}\n" for node in kept)


def _statements(cells: Sequence[str]) -> Iterator[ast.stmt]:
    """Yield all cells' statements in turn, without notebook lines (%, !) and bad cells."""
    for cell in cells:
        lines = [e for e in cell.splitlines() if not e.lstrip().startswith(("%", "!"))]
        try:
            yield from ast.parse("\n".join(lines)).body
        except SyntaxError:
            continue


def _binds(node: ast.stmt) -> list[str]:
    """Return the names that a statement binds in its cell."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return [node.name]
    if isinstance(node, ast.Expr):
        return []
    return [
        e.id for e in ast.walk(node) if isinstance(e, ast.Name) and isinstance(e.ctx, ast.Store)
    ]
