"""Which modules a file imports, read off its text."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ("integrators", "reference", "studies")
SOURCES = [p for name in FOLDERS for p in sorted((ROOT / name).rglob("*.py"))]
#: names that import by a string; no file of `reference` may use them
DYNAMIC = ("__import__", "import_module")


def module_of(path: Path) -> str:
    """The name that a file of the packages is imported by."""
    parts = ("discmech", *path.relative_to(ROOT).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported(
    source: str, module: str, is_package: bool = False, *, typing: bool = True
) -> Iterator[str]:
    """Absolute names of the modules a source imports (relative ones resolved), a.b for `from a`.

    Uses of `DYNAMIC` are told by their names. typing: whether imports for type checkers count.
    """
    tree = ast.parse(source)
    hidden = set()
    if not typing:  # what only a type checker sees does not bind the program
        for node in ast.walk(tree):
            if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
                hidden |= {id(inner) for inner in ast.walk(node)}
    package = module.split(".") if is_package else module.split(".")[:-1]
    for node in ast.walk(tree):
        if id(node) in hidden:
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            stem = ".".join([*base, *filter(None, [node.module])])
            yield from (f"{stem}.{alias.name}" for alias in node.names)
        elif isinstance(node, (ast.Name, ast.Attribute)):
            name = node.id if isinstance(node, ast.Name) else node.attr
            if name in DYNAMIC:
                yield name


@cache
def imports_of(path: Path, *, typing: bool = True) -> frozenset[str]:
    """What a file of the packages imports, as `imported` says it."""
    text = path.read_text(encoding="utf-8")
    return frozenset(imported(text, module_of(path), path.name == "__init__.py", typing=typing))


def within(name: str, *packages: str) -> bool:
    """Whether it is one of the packages, or in one of them."""
    return any(name == p or name.startswith(p + ".") for p in packages)


def under(*folders: str) -> list[Path]:
    """The sources in these folders, or the files of these names."""
    return [p for p in SOURCES if any(p.is_relative_to(ROOT / f) for f in folders)]
